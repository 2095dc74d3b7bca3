"""How far the work in a folder is: of a sweep, a placement, a run, or a paper of several runs; while it goes on too."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from harness.core.files import TEMPORARY, read_json
from harness.errors import BadFile
from harness.experiment.scenario import dotted_keys
from harness.results.index import INDEX_FILE, CellIndex
from harness.results.lock import is_running
from harness.results.manifest import Manifest
from harness.results.storage import read_summary


@dataclass(frozen=True)
class RunStatus:
    """Of one folder."""

    kind: str
    """`sweep`, `placement`, `run` or `paper`."""
    name: str
    planned: int
    finished: int
    failures: Mapping[str, str]
    """Cell -> a refusal or a traceback."""
    running: bool
    """Whether a process works there now."""
    left_s: float | None = None
    """At the pace of now, or of the last time [s]; None where there is none to tell it from."""

    @property
    def remaining(self) -> int:
        """Cells that are neither finished nor failed."""
        return max(self.planned - self.finished - len(self.failures), 0)


def read_status(out: Path) -> RunStatus:
    """BadFile when the folder holds no work of ours."""
    if (out / INDEX_FILE).is_file():
        return _index_status(out)
    if (out / "manifest.json").is_file():
        return _run_status(out)
    runs = [_run_status(file.parent) for file in sorted(out.glob("*/manifest.json"))]
    if not runs:
        found = "no such folder" if not out.is_dir() else "neither index.sqlite nor manifest.json"
        raise BadFile(out, found, "a folder of `harness sweep` or `harness run`", "Name the one given as --out.")
    failures = {f"{run.name}: {cell}": text for run in runs for cell, text in run.failures.items()}
    planned, finished = sum(run.planned for run in runs), sum(run.finished for run in runs)
    return RunStatus("paper", out.name, planned, finished, failures, any(run.running for run in runs))


def _index_status(out: Path) -> RunStatus:
    now, running = time.time(), is_running(out)
    with CellIndex(out, read_only=True) as index:
        counts, facts, failures, unwritten = index.counts(), index.facts(), index.failures(), index.unwritten()
    kind = str(read_json(out / "study.json", "what a study is").get("kind", "placement"))
    finished = min(counts.finished + unwritten, counts.planned - counts.failed)
    found = RunStatus(kind, str(facts.get("name", out.name)), counts.planned, finished, failures, running)
    made = facts.get("made", 0) + (unwritten if running else 0)
    took_s = (now if running else facts.get("seen_s", now)) - facts.get("started_s", now)
    return replace(found, left_s=took_s / made * found.remaining if made and found.remaining and took_s > 0.0 else None)


def _run_status(out: Path) -> RunStatus:
    """A run writes down what failed when it ends; until then its finished cells are counted."""
    manifest = Manifest.read(out / "manifest.json")
    try:
        planned = _count_planned(manifest.inputs, manifest.circumstances)
    except (KeyError, TypeError) as error:
        raise BadFile(out / "manifest.json", f"no {error}", "the manifest of a run", "Run it again.") from error
    running = is_running(out)
    written_s = sorted(
        path.stat().st_mtime for path in (out / "cells").glob("*") if not path.name.startswith(TEMPORARY)
    )
    summary = out / "summary.json"
    if not running and summary.is_file() and (not written_s or summary.stat().st_mtime >= written_s[-1]):
        content = read_summary(out)
        planned, finished = content["cells_planned"], content["cells_finished"]
        return RunStatus("run", out.name, planned, finished, content["failures"], running)
    since_s = (out / "manifest.json").stat().st_mtime
    made = [at for at in written_s if at >= since_s]
    found = RunStatus("run", out.name, planned, min(len(written_s), planned), {}, running)
    took_s = (time.time() if running else max(made, default=since_s)) - since_s
    return replace(found, left_s=took_s / len(made) * found.remaining if made and found.remaining else None)


def _count_planned(inputs: Mapping[str, Any], circumstances: Mapping[str, Any]) -> int:
    variants = math.prod(len(values) for _, values in dotted_keys(inputs["vary"]))
    return variants * len(inputs["motion"]["test"]) * len(inputs["inputs"]) * len(circumstances["methods"])
