"""What a folder of results holds, told by the files in it, and its lock, which a process holds while it writes there.

The operating system releases the lock however the process ends.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from harness.core.file_kind import wrong_file
from harness.core.files import read_json
from harness.errors import BadFile, BadInput
from harness.results.files.digests import STUDY_FILE
from harness.results.index import INDEX_FILE, CellIndex

BASELINES = Path("results/baselines")
"""Folder of baselines that commands find by name."""
CELLS_FILE = "cells.json"
"""File of a baseline (see `compare.baseline.write_baseline`)."""
FINDINGS = "findings.json"
"""File of a finished placement study, paper or trust study."""
LOCK_FILE = ".lock"
_KINDS = {
    "run": ("a run", "`harness report`, `view`, `table` and `plot` show it."),
    "sweep": ("a sweep", "`harness report` and `harness compare` show it."),
    "placement": ("a placement study", "`harness report` and `harness plot` show it."),
    "paper": ("the study of a paper", "`harness report` shows it. Each run of it is a folder in it."),
    "trust": ("a trust study", "Its command, `harness trust`, writes its page, report.html in the folder."),
    "benchmark": ("the work of a benchmark", "Its command, `harness bench`, prints the result."),
    "baseline": ("a baseline", "`harness compare` reads it. Its run is the folder that it was saved from."),
    "": ("no results of the harness", "Name the folder that `harness run` or another verb was given as --out."),
}
"""Kind -> what it is called, and what shows it."""


def find_results(where: Path | str) -> Path:
    """The folder of that name, or of the baseline of that name where no such folder exists."""
    baseline = BASELINES / where
    return baseline if not Path(where).exists() and (baseline / CELLS_FILE).is_file() else Path(where)


def folder_kind(out: Path) -> str:
    """One of `run`, `sweep`, `placement`, `paper`, `trust`, `benchmark` and `baseline`; "" for any other folder.

    Only the files that tell the kind are read, and without their digests. BadFile when one of them is damaged.
    """
    study, findings = (read_json(out / name, name) if (out / name).is_file() else {} for name in (STUDY_FILE, FINDINGS))
    if study.get("study") == "trust" or "plan_digest" in findings:
        return "trust"
    if "benchmark" in study:
        return "benchmark"
    if "placement" in study or findings.get("kind") == "placement":
        return "placement"
    if study or (out / FINDINGS).is_file():
        return "paper"
    if (out / CELLS_FILE).is_file():
        return "baseline"
    if not ((out / INDEX_FILE).exists() or (out / "manifest.json").exists()):
        return ""
    with CellIndex(out, read_only=True) as index:
        return str(index.facts().get("kind", "placement"))


def require_kind(out: Path, *kinds: str) -> str:
    """The kind of a folder; BadFile, which names what the folder holds and what shows it, unless it is one of these."""
    *others, last = (_KINDS[kind][0] for kind in kinds)
    expected = f"{', '.join(others)} or {last}" if others else last
    if not out.is_dir():
        found = "a file, not a folder" if out.exists() else "no such folder"
        raise wrong_file(out, found, expected, _KINDS[""][1])
    if (kind := folder_kind(out)) not in kinds:
        found, advice = _KINDS.get(kind, _KINDS[""])
        raise BadFile(out, found, expected, advice)
    return kind


@contextmanager
def folder_lock(out: Path) -> Iterator[None]:
    """Hold the lock of a folder, so that one process at a time writes there; BadInput when another process holds it."""
    try:
        with FileLock(out / LOCK_FILE, timeout=0):
            yield
    except Timeout as error:
        advice = f"`harness status {out}` shows its progress. Wait for it, or name another folder."
        raise BadInput(f"Another process uses {out}.", advice) from error


def is_running(out: Path) -> bool:
    """Whether a process holds the folder's lock, on this machine or on another one that shares the file system."""
    if not (out / LOCK_FILE).is_file():
        return False
    try:
        with FileLock(out / LOCK_FILE, timeout=0):
            return False
    except Timeout:
        return True
    except OSError:  # a folder that cannot be written: nobody works there
        return False
