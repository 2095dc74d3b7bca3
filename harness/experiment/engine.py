"""The engine: it runs the cells of scenarios into one folder, for a run, a sweep or a placement study.

The way of a scenario:

1. `scenarios/scenario_reader` reads a TOML file into a `Scenario`, a frozen record that is checked once.
2. `plan` replaces patterns by clips, refuses names that do not exist, and makes one frozen `RunPlan`: cells, tasks and
   manifest.
3. `workers/task_loop` hands the tasks to an executor. In a worker `cells` makes and writes each cell: `clip_evaluation`
   prepares the clip, and `evaluation` trains the method, runs it over the frames and scores its answers.
4. `run_store` keeps the outcomes in the index of the folder, and writes the summary at the end.

A run is a sweep of one scenario. Finished cells are kept, and the same command resumes an interrupted folder. Workers
write cells, this process alone writes the index and the summary.
"""

import os
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.core.fault_report import named_folder_fault
from harness.core.progress import ProgressCallback
from harness.errors import Outcome
from harness.experiment.cells import clear_caches
from harness.experiment.methods.isolation import DEFAULT_ISOLATION, Isolation
from harness.experiment.methods.remote_method import close_methods
from harness.experiment.plan import RunOptions, plan_cells, plan_run, plan_sweep
from harness.experiment.run_store import CellStore, RunFolder
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.sweep_config import Sweep
from harness.experiment.workers.executors import TaskExecutor, process_executor, run_in_process
from harness.experiment.workers.task_loop import evaluate_tasks
from harness.mocap import LibraryFolders
from harness.results import CellIndex


@dataclass(frozen=True)
class BatchResults:
    """Results of the cells that `run_cells` was asked for."""

    rows: tuple[Mapping[str, Any], ...]
    """Rows of the finished cells in planned order, as `results.cell.as_row` gives them, and `seconds`."""
    failures: Mapping[str, str]
    """Cell -> a refusal in one line, or a traceback."""
    planned: int


def run(
    scenario: Scenario,
    out: Path,
    *,
    folder: LibraryFolders | None = None,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda cell, done, planned: None,
    isolation: Isolation = DEFAULT_ISOLATION,
) -> Outcome:
    """Run the cells of a scenario that are not finished yet, with `jobs` processes, and write the summary.

    The folder `out` is created, or resumed if it holds this scenario, else refused (BadInput). `folder` is the library
    of real motion. Methods from outside the package run in processes of their own, within the limits of `isolation`. A
    cell that fails is listed with its traceback and stops no other cell. Names that do not exist are
    refused before anything is written. If every cell is refused, the first refusal is raised (BadInput). The first
    Ctrl-C lets running cells finish before KeyboardInterrupt is raised, the second one stops at once.

    Returns PASS; INCOMPLETE if cells are missing; NOT_COMPARABLE if no cell reached the floor of coverage.
    """
    clear_caches()
    plan = plan_run(scenario, RunOptions(folder, jobs, command, isolation))
    results = RunFolder(plan, out, progress)
    with process_executor(jobs) as executor:
        return _fill(results, executor)


def run_sweep(
    sweep: Sweep,
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    folder: LibraryFolders | None,
    executor: TaskExecutor,
    workers: int,
    command: str,
    only: str = "",
    progress: ProgressCallback = lambda cell, done, planned: None,
    isolation: Isolation = DEFAULT_ISOLATION,
) -> Outcome:
    """Run the cells of a sweep's scenarios that are not finished yet, or `only` the cell of that name; see `run`.

    `command` repeats the sweep; with `--cell` and a name it runs one cell.
    """
    clear_caches()
    plan = plan_sweep(sweep.name, scenarios, RunOptions(folder, workers, command, isolation))
    results = RunFolder(plan.select(only, out) if only else plan, out, progress)
    return _fill(results, executor)


def run_cells(
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    folder: LibraryFolders | None,
    executor: TaskExecutor,
    command: str,
    progress: ProgressCallback = lambda cell, done, planned: None,
    workers: int | None = None,
) -> BatchResults:
    """Run the cells of scenarios that the existing folder `out` does not have yet, and return the results of all.

    A search calls this again and again in one folder, whose lock it holds; cells of earlier calls stay in the index.
    Tasks are planned for `workers` workers, by default one per core. BadInput when two cells have the same name.
    """
    plan = plan_cells(scenarios, RunOptions(folder, workers or os.cpu_count() or 1, command))
    with named_folder_fault(out), CellIndex(out) as index:
        store = CellStore(out, plan, index, progress)
        _evaluate(store, executor)
        index.write_digest({})
        return BatchResults(*store.results(), planned=len(plan.names))


def _fill(results: RunFolder, executor: TaskExecutor) -> Outcome:
    """Evaluate the cells of a plan into its folder."""
    with results.opened() as store:
        try:
            _evaluate(store, executor)
        finally:
            close_methods()
    return results.outcome


def _evaluate(store: CellStore, executor: TaskExecutor) -> None:
    """Evaluate the tasks of a plan, and store the outcome of each cell as it ends."""
    in_workers = executor is not run_in_process  # which reports every cell as it ends
    tasks = evaluate_tasks(store.plan.tasks, store.out, store.stop, executor)
    with store.recording(watched=in_workers), closing(tasks) as outcomes:
        for outcome in outcomes:
            store.record(outcome)
