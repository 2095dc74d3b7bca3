"""The folder of a sweep: study.json, manifest.json, cells/ and their index; table.csv, summary.json, failures.json."""

import difflib
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness.core.files import write_json
from harness.errors import BadInput, Outcome
from harness.experiment.cell_scheduler import cell_names, plan_tasks, run_tasks, scenario_label, split_task
from harness.experiment.cells import ProgressCallback, clear_caches, open_scenario_motion
from harness.experiment.executors import TaskExecutor
from harness.experiment.scenario import Scenario, dotted_keys
from harness.experiment.sweep_config import Sweep, check_scenario_names
from harness.reconstruct import registry
from harness.results import manifest, storage
from harness.results.index import CellIndex
from harness.results.lock import folder_lock
from harness.results.manifest import Manifest
from harness.results.table import compute_group_statistics, write_table
from harness.score.metrics import VERSIONS

_CIRCUMSTANCE_KEYS = ("name", "methods", "expected_order", "left_out", "fault")


def run_sweep(
    sweep: Sweep,
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    folder: Path | None,
    each: TaskExecutor,
    workers: int,
    command: str,
    only: str = "",
    progress: ProgressCallback = lambda cell, done, planned: None,
) -> Outcome:
    """Make what is not finished yet of the scenarios that the sweep comes to, or `only` the cell of that name.

    `out` is made, or resumed when it holds this very sweep, else refused (BadInput), as it is while another process is
    at work there. `command` repeats the sweep; with --cell and a name it makes one cell. INCOMPLETE when cells failed
    or are still to be made; NOT_COMPARABLE when nothing was measured; BadInput when all cells were refused.
    """
    clear_caches()
    check_scenario_names(scenarios, folder)
    names = [name for scenario in scenarios for name in cell_names(scenario)]
    tasks = plan_tasks(scenarios, folder, command, workers)
    if only:
        tasks = [one for task in tasks for one in split_task(task) if one.cells() == [only]]
        if not tasks:
            near = difflib.get_close_matches(only, names, n=1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            raise BadInput(f"No cell is called {only!r}.{hint}", f"`harness status {out}` names those that failed.")
    storage.open_run(out, _sweep_manifest(sweep, scenarios, folder, command))
    with folder_lock(out), CellIndex(out) as index:
        write_json(out / "study.json", {"kind": "sweep", **asdict(sweep), "command": command})
        index.add_from_folders()
        index.plan(names)
        index.note(name=sweep.name, command=command)
        try:
            ended = run_tasks(index, [only] if only else names, tasks, out, each, progress)
        finally:
            _write_results(index, out, sweep, scenarios, command)
        if ended and all(cell.refused for cell in ended.values()):
            raise BadInput(f"Nothing could be run. {next(iter(ended.values())).failure}", "")
        return _outcome(index)


def _outcome(index: CellIndex) -> Outcome:
    counts = index.counts()
    if counts.finished < counts.planned:
        return Outcome.INCOMPLETE
    measured = any(value is not None for (value,) in index.columns("joint_angle_mean_deg"))
    return Outcome.PASS if measured else Outcome.NOT_COMPARABLE


def _write_results(index: CellIndex, out: Path, sweep: Sweep, scenarios: Sequence[Scenario], command: str) -> None:
    counts, failures = index.counts(), index.failures()
    write_table(index, out / "table.csv")
    write_json(out / "failures.json", {cell: _failure_entry(text, cell, command) for cell, text in failures.items()})
    write_json(
        out / "summary.json",
        {
            "kind": "sweep",
            "name": sweep.name,
            "outcome": _outcome(index).word,
            "cells_finished": counts.finished,
            "cells_planned": counts.planned,
            "failures": failures,
            "scenarios": [scenario_label(scenario) for scenario in scenarios],
            "vary": dict(dotted_keys(sweep.vary)),
            "groups": compute_group_statistics(index),
        },
    )


def _failure_entry(text: str, cell: str, command: str) -> Mapping[str, Any]:
    return {"failure": text, "rerun": f"{command} --cell {shlex.quote(cell)}"}


def _sweep_manifest(sweep: Sweep, scenarios: Sequence[Scenario], folder: Path | None, command: str) -> Manifest:
    """Methods are a circumstance, as of a run: the same sweep may be given others."""
    names = dict.fromkeys(name for scenario in scenarios for name in scenario.methods)
    inputs = {
        scenario_label(scenario): {k: v for k, v in asdict(scenario).items() if k not in _CIRCUMSTANCE_KEYS}
        for scenario in scenarios
    }
    sources = dict.fromkeys(open_scenario_motion(s.motion, folder, s.seed).title for s in scenarios)
    return Manifest(
        inputs={"sweep": sweep.name, "scenarios": inputs, "motion_source": list(sources)},
        metric_versions=VERSIONS,
        circumstances={
            "methods": list(names),
            "constants": {name: repr(registry.resolve(name)) for name in names},
            "command": command,
            **manifest.current_circumstances(),
        },
    )
