"""Files of results: their kinds, digests and checks."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.files.digests import (
        check_key,
        file_digest,
        insert_digest,
        read_record,
        read_result_json,
        write_record,
        write_result_json,
    )
    from harness.results.files.folder_kind import (
        BASELINES,
        CELLS_FILE,
        FINDINGS,
        find_results,
        folder_lock,
        is_running,
        require_kind,
    )
    from harness.results.files.integrity import (
        SUMMARY,
        check_cells,
        check_folder,
        check_index,
        check_row,
        compute_digests,
        read_summary_json,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "BASELINES",
    "CELLS_FILE",
    "FINDINGS",
    "SUMMARY",
    "check_cells",
    "check_folder",
    "check_index",
    "check_key",
    "check_row",
    "compute_digests",
    "file_digest",
    "find_results",
    "folder_lock",
    "insert_digest",
    "is_running",
    "read_record",
    "read_result_json",
    "read_summary_json",
    "require_kind",
    "write_record",
    "write_result_json",
]
