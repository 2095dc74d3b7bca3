"""The folders that figures and tables are made from: a run, or a placement study."""

from pathlib import Path
from typing import Literal

from harness.errors import BadFile, BadInput
from harness.report.placement.writer import FINDINGS
from harness.results.index import INDEX_FILE
from harness.results.placement_findings import is_placement_findings
from harness.results.reader import CELLS_FILE
from harness.results.storage import read_kind

SourceKind = Literal["run", "placement"]
_EXPECTED, _ADVICE = "the folder of a run or a placement study", "`harness run` and `harness placement` write one."


def find_kind(folder: Path) -> SourceKind:
    """What a folder holds. BadFile when it holds no results, BadInput for a sweep, a paper or a baseline."""
    if not folder.is_dir():
        raise BadFile(folder, "no such folder", _EXPECTED, _ADVICE)
    if (folder / FINDINGS).exists():
        if is_placement_findings(folder / FINDINGS):
            return "placement"
        raise BadInput(f"{folder} holds the findings of a paper.", "Name the folder of one of its runs.")
    if (folder / CELLS_FILE).exists():
        raise BadInput(f"{folder} is a baseline.", "Name the folder of the run that it was saved from.")
    if not ((folder / INDEX_FILE).exists() or (folder / "manifest.json").exists()):
        raise BadFile(folder, "no results", _EXPECTED, _ADVICE)
    if (kind := read_kind(folder)) == "sweep":
        raise BadInput(f"{folder} is a sweep.", "Name a run; `harness report` draws the page of a sweep.")
    return "run" if kind == "run" else "placement"
