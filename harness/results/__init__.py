"""What a run leaves on disk: cells, index, manifest, summary, and their readers."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.results.cell import Cell as Cell
    from harness.results.cell import as_row as as_row
    from harness.results.cell import cell_folder as cell_folder
    from harness.results.cell import has_cell as has_cell
    from harness.results.cell import lag_of as lag_of
    from harness.results.cell import read_cell as read_cell
    from harness.results.cell import read_row as read_row
    from harness.results.cell import setting_text as setting_text
    from harness.results.cell import varied_text as varied_text
    from harness.results.cell import write_cell as write_cell
    from harness.results.index import INDEX_FILE as INDEX_FILE
    from harness.results.index import CellIndex as CellIndex
    from harness.results.manifest import Manifest as Manifest
    from harness.results.manifest import current_circumstances as current_circumstances
    from harness.results.manifest import describe_run as describe_run
    from harness.results.manifest import flatten as flatten
    from harness.results.manifest import source_hash as source_hash
    from harness.results.reader import BASELINE_FILES as BASELINE_FILES
    from harness.results.reader import COUNT_METRICS as COUNT_METRICS
    from harness.results.reader import SCHEMA as SCHEMA
    from harness.results.reader import CellResult as CellResult
    from harness.results.reader import LoadedRun as LoadedRun
    from harness.results.reader import ResultSet as ResultSet
    from harness.results.reader import load_results as load_results
    from harness.results.reader import load_run as load_run
    from harness.results.reader import select_cells as select_cells
    from harness.results.reported_metrics import MAX_FALLBACK_SHARE as MAX_FALLBACK_SHARE
    from harness.results.reported_metrics import PRIMARY_METRIC as PRIMARY_METRIC
    from harness.results.reported_metrics import SECONDARY_METRIC as SECONDARY_METRIC
    from harness.results.storage import cell_key as cell_key
    from harness.results.storage import open_run as open_run
    from harness.results.storage import open_study as open_study
    from harness.results.storage import read_cells as read_cells
    from harness.results.storage import read_summary as read_summary
    from harness.results.storage import remove_leftovers as remove_leftovers
    from harness.results.storage import write_summary as write_summary
    from harness.results.table import TIME_COLUMNS as TIME_COLUMNS
    from harness.results.table import compute_group_statistics as compute_group_statistics
    from harness.results.table import write_table as write_table
else:
    __getattr__, __dir__ = lazy_names(__name__)
