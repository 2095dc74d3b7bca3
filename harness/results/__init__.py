"""What a run leaves on disk: cells, index, manifest, summary, and their readers."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.cell import (
        Cell,
        as_row,
        cell_folder,
        has_cell,
        lag_of,
        read_cell,
        read_row,
        setting_text,
        varied_text,
        write_cell,
    )
    from harness.results.index import INDEX_FILE, CellIndex
    from harness.results.manifest import Manifest, current_circumstances, describe_run, flatten, source_hash
    from harness.results.reader import (
        BASELINE_FILES,
        COUNT_METRICS,
        SCHEMA,
        CellResult,
        LoadedRun,
        ResultSet,
        load_results,
        load_run,
        select_cells,
    )
    from harness.results.reported_metrics import MAX_FALLBACK_SHARE, PRIMARY_METRIC, SECONDARY_METRIC
    from harness.results.storage import (
        cell_key,
        open_run,
        open_study,
        read_cells,
        read_summary,
        remove_leftovers,
        write_summary,
    )
    from harness.results.table import TIME_COLUMNS, compute_group_statistics, write_table
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "BASELINE_FILES",
    "COUNT_METRICS",
    "INDEX_FILE",
    "MAX_FALLBACK_SHARE",
    "PRIMARY_METRIC",
    "SCHEMA",
    "SECONDARY_METRIC",
    "TIME_COLUMNS",
    "Cell",
    "CellIndex",
    "CellResult",
    "LoadedRun",
    "Manifest",
    "ResultSet",
    "as_row",
    "cell_folder",
    "cell_key",
    "compute_group_statistics",
    "current_circumstances",
    "describe_run",
    "flatten",
    "has_cell",
    "lag_of",
    "load_results",
    "load_run",
    "open_run",
    "open_study",
    "read_cell",
    "read_cells",
    "read_row",
    "read_summary",
    "remove_leftovers",
    "select_cells",
    "setting_text",
    "source_hash",
    "varied_text",
    "write_cell",
    "write_summary",
    "write_table",
]
