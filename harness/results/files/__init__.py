"""Files of results: their kinds, digests and checks."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.files.digests import check_key as check_key
    from harness.results.files.digests import file_digest as file_digest
    from harness.results.files.digests import insert_digest as insert_digest
    from harness.results.files.digests import read_record as read_record
    from harness.results.files.digests import read_result_json as read_result_json
    from harness.results.files.digests import write_record as write_record
    from harness.results.files.digests import write_result_json as write_result_json
    from harness.results.files.folder_kind import BASELINES as BASELINES
    from harness.results.files.folder_kind import CELLS_FILE as CELLS_FILE
    from harness.results.files.folder_kind import FINDINGS as FINDINGS
    from harness.results.files.folder_kind import find_results as find_results
    from harness.results.files.folder_kind import folder_lock as folder_lock
    from harness.results.files.folder_kind import is_running as is_running
    from harness.results.files.folder_kind import require_kind as require_kind
    from harness.results.files.integrity import SUMMARY as SUMMARY
    from harness.results.files.integrity import check_cells as check_cells
    from harness.results.files.integrity import check_folder as check_folder
    from harness.results.files.integrity import check_index as check_index
    from harness.results.files.integrity import check_row as check_row
    from harness.results.files.integrity import compute_digests as compute_digests
    from harness.results.files.integrity import read_summary_json as read_summary_json
else:
    __getattr__, __dir__ = lazy_names(__name__)
