"""Progress of the work in a folder: a run, a sweep, a placement study, or a paper of several runs."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from harness.errors import BadFile
from harness.results import INDEX_FILE, CellIndex
from harness.results.files import check_folder, check_index, is_running, require_kind


@dataclass(frozen=True)
class RunStatus:
    """Progress of one folder."""

    kind: str
    """`run`, `sweep`, `placement` or `paper`; `study` of one of the last two that has no cells yet."""
    name: str
    command: str
    """Command that resumes the work."""
    planned: int
    finished: int
    failures: Mapping[str, str]
    """Failed cell -> a refusal or a traceback."""
    running: bool
    """Whether a process works in the folder now."""
    left_s: float | None = None
    """Estimated remaining time at the pace of the current or last process [s]; None if no pace is known."""

    @property
    def remaining(self) -> int:
        """Number of cells that are neither finished nor failed."""
        return max(self.planned - self.finished - len(self.failures), 0)


def read_status(out: Path) -> RunStatus:
    """Progress of a folder, also while a process works there.

    BadFile for a folder that the harness did not write, and for one whose files are damaged or edited.
    """
    if (out / INDEX_FILE).exists() or (out / "manifest.json").exists():
        return _read_index_status(out)
    runs = [_read_index_status(file.parent) for file in sorted(out.glob(f"*/{INDEX_FILE}"))]
    running = is_running(out) or any(run.running for run in runs)
    if not runs and running:  # it has just begun
        return RunStatus("study", out.name, "", 0, 0, {}, running)
    if not runs:
        kind = require_kind(out, "run", "sweep", "placement", "paper")
        raise BadFile(out, f"the work of a {kind} without cells", "a finished cell", "Give its command again.")
    failures = {f"{run.name}: {cell}": text for run in runs for cell, text in run.failures.items()}
    planned, finished = sum(run.planned for run in runs), sum(run.finished for run in runs)
    return RunStatus("paper", out.name, runs[0].command, planned, finished, failures, running)


def _read_index_status(out: Path) -> RunStatus:
    (check_folder if (out / "manifest.json").is_file() else check_index)(out)
    now, running = time.time(), is_running(out)
    with CellIndex(out, read_only=True) as index:
        counts, facts, failures, unwritten = index.counts(), index.facts(), index.failures(), index.unwritten()
    finished = min(counts.finished + unwritten, counts.planned - counts.failed)
    remaining = max(counts.planned - finished - len(failures), 0)
    made = facts.get("made", 0) + (unwritten if running else 0)
    elapsed_s = (now if running else facts.get("seen_s", now)) - facts.get("started_s", now)
    kind, name, command = (str(facts.get(key, "")) for key in ("kind", "name", "command"))
    return RunStatus(
        kind=kind or "placement",
        name=name if kind == "sweep" else out.name,
        command=command,
        planned=counts.planned,
        finished=finished,
        failures=failures,
        running=running,
        left_s=elapsed_s / made * remaining if made and remaining and elapsed_s > 0.0 else None,
    )
