"""The engine: it runs the cells of scenarios into one folder, for a run, a sweep or a placement study.

A run is a sweep of one scenario. Finished cells are kept, and the same command resumes an interrupted folder. Workers
write cells, this process alone writes the index and the summary.
"""

import difflib
import os
import time
import traceback
from collections.abc import Mapping, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import closing, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from harness.core.fault_report import named_folder_fault
from harness.core.files import TEMPORARY, content_key
from harness.core.progress import ProgressCallback
from harness.core.split import ClipPart, declared_training_data
from harness.errors import BadInput, HarnessError, Outcome
from harness.experiment.cells import (
    CellOutcome,
    ClipTask,
    cell_names,
    check_names,
    clear_caches,
    open_scenario_motion,
    plan_tasks,
    run_task,
    scenario_label,
    split_task,
)
from harness.experiment.methods.isolation import DEFAULT_ISOLATION, Isolation
from harness.experiment.methods.method_process import MethodFailure
from harness.experiment.methods.remote_method import close_methods, describe_options, hash_method, resolve_method
from harness.experiment.scenario import Scenario, dotted_keys, expand_clips
from harness.experiment.sweep_config import Sweep
from harness.experiment.workers.cell_watcher import ProgressCount, graceful_stop
from harness.experiment.workers.executors import TaskExecutor, process_executor, run_in_process
from harness.mocap.library import LibraryFolders
from harness.results import storage
from harness.results.index import CellIndex
from harness.results.manifest import Manifest, describe_run, source_hash

_CIRCUMSTANCE_KEYS = ("name", "methods", "expected_order", "left_out", "fault", "unit")
"""Keys of a scenario that are no inputs of a sweep; the name is in the scenario's label."""


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
    scenario = expand_clips(scenario, folder)
    content = scenario.content()
    del content["fault"]  # faults concern the emulator alone, a run does not depend on them
    with process_executor(jobs) as executor:
        return _run_folder(
            "run", scenario.name, content, [scenario], out, folder, executor, jobs, command, progress, isolation
        )


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
    content = {
        "sweep": sweep.name,
        "scenarios": {
            scenario_label(scenario): {k: v for k, v in scenario.content().items() if k not in _CIRCUMSTANCE_KEYS}
            for scenario in scenarios
        },
        "methods": list(dict.fromkeys(name for scenario in scenarios for name in scenario.methods)),
    }
    return _run_folder(
        "sweep", sweep.name, content, scenarios, out, folder, executor, workers, command, progress, isolation, only
    )


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
    names = [name for scenario in scenarios for name in cell_names(scenario)]
    _check_distinct(names)
    tasks = plan_tasks(scenarios, folder, command, workers or os.cpu_count() or 1)
    with named_folder_fault(out), CellIndex(out) as index:
        outcomes = _run_tasks(index, names, tasks, out, executor, progress)
        keys = [outcomes[name].key for name in names if name in outcomes and not outcomes[name].failure]
        failures = {name: outcomes[name].failure for name in names if name in outcomes and outcomes[name].failure}
        index.write_digest({})
        return BatchResults(tuple(index.rows_of(keys)), failures, len(names))


def _run_folder(
    kind: str,
    name: str,
    content: Mapping[str, Any],
    scenarios: Sequence[Scenario],
    out: Path,
    folder: LibraryFolders | None,
    executor: TaskExecutor,
    workers: int,
    command: str,
    progress: ProgressCallback,
    isolation: Isolation,
    only: str = "",
) -> Outcome:
    """Run scenarios into a folder of their own; `content` is what the manifest says of them."""
    clear_caches()
    isolation = replace(isolation, workers=min(workers, os.cpu_count() or 1))
    check_names(scenarios, folder, isolation)
    labelled = kind == "sweep"
    names = [cell for scenario in scenarios for cell in cell_names(scenario, labelled=labelled)]
    tasks = plan_tasks(scenarios, folder, command, workers, labelled=labelled, isolation=isolation)
    if only:
        tasks = [single for task in tasks for single in split_task(task) if str(single.cells()[0]) == only]
        if not tasks:
            near = difflib.get_close_matches(only, names, n=1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            raise BadInput(f"No cell is called {only!r}.{hint}", f"`harness status {out}` names those that failed.")
    _check_distinct(names)
    manifest = _describe(content, scenarios, folder, command, isolation)
    with storage.open_run(out, manifest), named_folder_fault(out), CellIndex(out) as index:
        index.add_from_folders()
        index.plan(names)
        index.note(kind=kind, name=name, command=command)
        try:
            outcomes = _run_tasks(index, [only] if only else names, tasks, out, executor, progress)
        finally:
            close_methods()
            summary = storage.write_summary(
                index,
                out,
                kind=kind,
                name=name,
                command=command,
                performers=manifest.performers,
                unit=manifest.unit,
                training_data=manifest.training_data,
                scenarios=[scenario_label(scenario) for scenario in scenarios],
                vary=dict(pair for scenario in scenarios for pair in dotted_keys(scenario.vary)),
                orders=scenarios[0].expected_order if kind == "run" else None,
            )
        if outcomes and all(cell.refused for cell in outcomes.values()):
            raise BadInput(f"Nothing could be run. {next(iter(outcomes.values())).failure}", "")
        return next(outcome for outcome in Outcome if outcome.word == summary["outcome"])


def _check_distinct(names: Sequence[str]) -> None:
    if len(set(names)) < len(names):
        twice = next(name for place, name in enumerate(names) if name in names[:place])
        raise BadInput(f"Two cells are called {twice!r}.", "Scenarios of other content need other names.")


def _describe(
    content: Mapping[str, Any],
    scenarios: Sequence[Scenario],
    folder: LibraryFolders | None,
    command: str,
    isolation: Isolation,
) -> Manifest:
    opened = [(open_scenario_motion(s.motion, folder, s.seed), s.motion.test) for s in scenarios]
    sources = list(dict.fromkeys(source.title for source, _ in opened))
    clips = {name: source for source, test in opened for name in (ClipPart.parse(text).clip for text in test)}
    performers = {name: known for name, source in clips.items() if (known := source.performer(name))}
    constants, training_data = dict[str, str](), dict[str, str]()
    for name in content["methods"]:
        with suppress(MethodFailure):  # its cells fail and say why
            method = resolve_method(name, isolation)
            constants[name], training_data[name] = describe_options(method), declared_training_data(method)
    return describe_run(
        content,
        motion_source=sources if "sweep" in content else sources[0],
        command=command,
        constants=constants,
        training_data=training_data,
        performers=performers,
        unit="clip" if all(scenario.unit == "clip" for scenario in scenarios) else "performer",
    )


def _run_tasks(
    index: CellIndex,
    names: Sequence[str],
    tasks: Sequence[ClipTask],
    out: Path,
    executor: TaskExecutor,
    progress: ProgressCallback,
) -> dict[str, CellOutcome]:
    """Run tasks and record every cell in the index; the outcomes of the cells by name."""
    (out / "cells").mkdir(exist_ok=True)
    storage.remove_leftovers(out)
    index.expect(names)
    # While the code is the same, cells of the last time count as finished before they are looked at again.
    sources, failed = _source_hash(tasks), index.failures()
    index.reset(names if index.facts().get("sources") != sources else [name for name in names if name in failed])
    index.note(sources=sources, started_s=time.time(), made=0)
    count = ProgressCount(out, lambda last, ended: progress(last, ended, len(names)))
    progress("", 0, len(names))  # a bar is there while the first cells compile
    stop, outcomes, made = out / f"{TEMPORARY}{os.getpid()}-stop", dict[str, CellOutcome](), 0

    def record(cell: CellOutcome) -> None:
        nonlocal made
        if cell.row is not None:
            index.add([cell.row], [cell.seconds or None])
        index.record_outcomes([(cell.cell, cell.key, cell.failure)])
        made += cell.seconds > 0.0
        index.note(made=made, seen_s=time.time())
        outcomes[cell.cell] = replace(cell, row=None)  # the row is in the index
        count.add(cell.cell, cell.key)

    def attempt(tasks: Sequence[ClipTask]) -> list[ClipTask]:
        """Run tasks; those whose worker died."""
        if not tasks or stop.exists():
            return []
        broken = []
        arguments = [(_session_id(), task, out.absolute(), stop.absolute()) for task in tasks]
        with closing(executor(run_task, arguments)) as ended:  # an interrupt stops its workers at once
            for which, future in ended:
                try:
                    for cell in future.result():
                        record(cell)
                except BrokenExecutor:
                    broken.append(tasks[which])
                except HarnessError as error:
                    if not out.is_dir():  # a worker calls it a folder that it does not see
                        raise FileNotFoundError(str(error)) from error
                    raise
                except Exception:  # the task could not be sent or answered: its cells fail, the others go on
                    failure = traceback.format_exc()
                    for planned in tasks[which].cells():
                        if str(planned) not in outcomes:
                            record(CellOutcome(str(planned), failure=failure))
        return broken

    try:
        in_workers = executor is not run_in_process  # which reports every cell as it ends
        with graceful_stop(stop), count.watching() if in_workers else nullcontext():
            broken = attempt(tasks)
            # One cell of a task may be to blame for the worker's death: the cells are tried one by one.
            for task in attempt([single for whole in broken for single in split_task(whole)]):
                record(CellOutcome(str(task.cells()[0]), failure="a worker process died"))
    finally:
        storage.remove_leftovers(out)  # of workers that were stopped at once
    return outcomes


@cache
def _session_id() -> str:
    """Name of this process for workers, which clear their caches when it changes."""
    return f"{os.getpid()} {time.time_ns()}"


def _source_hash(tasks: Sequence[ClipTask]) -> str:
    """Hash of the source of the package and of all methods."""
    hashes: dict[str, str] = {}
    for name, isolation in sorted(
        {(name, task.isolation) for task in tasks for name in task.scenario.methods}, key=str
    ):
        with suppress(MethodFailure):
            hashes[name] = hash_method(resolve_method(name, isolation))
    return content_key([source_hash(), hashes])
