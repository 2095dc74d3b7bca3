"""Many cells in one folder: what is finished is kept, whoever works at it and wherever it was stopped.

A cell is a folder of its own, named by all that defines it. Workers write cells, the coordinator alone the index.
"""

import os
import time
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from platform import node
from typing import Any, TypeVar

from harness.core.files import TEMPORARY, content_key
from harness.core.split import ClipPart
from harness.errors import BadInput, HarnessError
from harness.experiment.cells import CellOutcome, ClipTask, PlannedCell, ProgressCallback, clear_caches, run_clip_task
from harness.experiment.executors import TaskExecutor
from harness.experiment.interruption import graceful_stop
from harness.experiment.scenario import Scenario, variants
from harness.reconstruct import registry
from harness.results.index import CellIndex
from harness.results.manifest import source_hash

T = TypeVar("T")

MAX_CELLS_PER_TASK = 200
"""Cells in one task: what is lost of the index when the coordinator is killed, and how often a bar moves."""
_TASKS_PER_WORKER = 4
"""For each worker in the end, if there are cells enough: the last one to end does not keep the others waiting long."""


@dataclass(frozen=True)
class CellResults:
    """What came of the cells that were asked for."""

    rows: tuple[Mapping[str, Any], ...]
    """Of those that finished, in planned order; as `results.cell.as_row` has them, and `seconds`."""
    failures: Mapping[str, str]
    """Cell -> why there is none: a refusal in one line, or a traceback."""
    planned: int


@dataclass(frozen=True)
class CellTask:
    """What a worker is given at once: some variants of a scenario on one clip, with some of its methods."""

    label: str
    """Goes before the names of its cells."""
    job: ClipTask

    def cells(self) -> list[str]:
        return [f"{self.label}: {cell}" for cell in self.job.cells()]


def run_cells(
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    folder: Path | None,
    each: TaskExecutor,
    command: str,
    progress: ProgressCallback = lambda cell, done, planned: None,
    workers: int | None = None,
) -> CellResults:
    """Make every cell of the scenarios that the folder `out` does not have yet; BadInput when two would have one name.

    Tasks are cut for so many `workers`, by default as many as there are cores.

    A cell that fails stops no other. The first Ctrl-C lets cells finish that run and raises KeyboardInterrupt
    afterwards, the second one stops at once.
    """
    with CellIndex(out) as index:
        names = [name for scenario in scenarios for name in cell_names(scenario)]
        tasks = plan_tasks(scenarios, folder, command, workers or os.cpu_count() or 1)
        ended = run_tasks(index, names, tasks, out, each, progress)
        keys = [ended[name].key for name in names if name in ended and not ended[name].failure]
        failures = {name: ended[name].failure for name in names if name in ended and ended[name].failure}
        return CellResults(tuple(index.rows_of(keys)), failures, len(names))


def scenario_label(scenario: Scenario) -> str:
    """What goes before the names of a scenario's cells."""
    return f"{scenario.name} seed {scenario.seed}"


def cell_names(scenario: Scenario) -> list[str]:
    """Names of all its cells as tables list them: varied values change slowest, then clips, inputs and methods."""
    parts = [ClipPart.parse(text) for text in scenario.motion.test]
    return [
        f"{scenario_label(scenario)}: {PlannedCell(made, varied, part, method, inputs)}"
        for varied, made in variants(scenario)
        for part in parts
        for inputs in made.inputs
        for method in made.methods
    ]


def plan_tasks(scenarios: Iterable[Scenario], folder: Path | None, command: str, workers: int) -> list[CellTask]:
    """Whole clips, whose cells share motion and learning; parts of the last ones, so that all workers end together."""
    whole = [(scenario_label(s), job, len(variants(s))) for s in scenarios for job in _clip_jobs(s, folder, command)]
    shared = max(min(len(whole), workers), 1)
    tasks = []
    for place, (name, job, count) in enumerate(whole):
        pieces = -(-_TASKS_PER_WORKER * workers // shared) if place >= len(whole) - shared else 1
        pieces = max(pieces, -(-count * _cells_per_variant(job.scenario) // MAX_CELLS_PER_TASK))
        parts = (tuple(some) if len(some) < count else () for some in _split_evenly(range(count), pieces))
        tasks += [CellTask(name, replace(job, chosen=chosen)) for chosen in parts]
    pieces = -(-workers // max(len(tasks), 1))
    return [
        replace(task, job=replace(task.job, scenario=replace(task.job.scenario, methods=tuple(some))))
        for task in tasks
        for some in _split_evenly(task.job.scenario.methods, pieces)
    ]


def run_tasks(
    index: CellIndex,
    names: Sequence[str],
    tasks: Sequence[CellTask],
    out: Path,
    each: TaskExecutor,
    progress: ProgressCallback,
) -> dict[str, CellOutcome]:
    """What became of each cell; see `run_cells`."""
    if len(set(names)) < len(names):
        twice = next(name for place, name in enumerate(names) if name in names[:place])
        raise BadInput(f"Two cells are called {twice!r}.", "Scenarios of other content need other names.")
    (out / "cells").mkdir(exist_ok=True)
    index.expect(names)
    sources, facts, failed = _source_hash(tasks), index.facts(), index.failures()
    index.reset(names if facts.get("sources") != sources else [name for name in names if name in failed])
    index.note(sources=sources, started_s=time.time(), made=0)
    stop, ended = out / f"{TEMPORARY}{os.getpid()}-stop", dict[str, CellOutcome]()
    with graceful_stop(stop):
        broken = []
        for task, cells in _completed_tasks(tasks, out, stop, each):
            if isinstance(cells, BrokenExecutor):
                broken.append(task)
                continue
            _record_results(index, task, cells, ended, progress, len(names))
        alone = [one for task in broken for one in split_task(task)]  # but one of them may be to blame
        for task, cells in _completed_tasks(alone, out, stop, each):
            if isinstance(cells, BrokenExecutor):
                cells = [CellOutcome(str(cell), failure="a worker process died") for cell in task.job.cells()]
            _record_results(index, task, cells, ended, progress, len(names))
    return ended


def _source_hash(tasks: Sequence[CellTask]) -> str:
    """Of all code at work: while it is as it was, what was finished counts as finished before it is looked at again."""
    names = sorted({name for task in tasks for name in task.job.scenario.methods})
    return content_key([source_hash(), [registry.source_hash(registry.resolve(name)) for name in names]])


def _record_results(
    index: CellIndex,
    task: CellTask,
    cells: Sequence[CellOutcome],
    ended: dict[str, CellOutcome],
    progress: ProgressCallback,
    planned: int,
) -> None:
    found = {f"{task.label}: {cell.cell}": cell for cell in cells}
    index.add((c.row for c in cells if c.row is not None), (c.seconds or None for c in cells if c.row is not None))
    index.record_outcomes((name, cell.key, cell.failure) for name, cell in found.items())
    for name, cell in found.items():
        ended[name] = replace(cell, row=None)  # it is in the index
        progress(name, len(ended), planned)
    made = sum(cell.seconds > 0.0 for cell in cells)
    index.note(made=index.facts()["made"] + made, seen_s=time.time())


def _completed_tasks(
    tasks: Sequence[CellTask], out: Path, stop: Path, each: TaskExecutor
) -> Iterator[tuple[CellTask, Sequence[CellOutcome] | BrokenExecutor]]:
    if not tasks or stop.exists():
        return
    for which, future in each(run_task, [(_session_id(), task.job, out.absolute(), stop.absolute()) for task in tasks]):
        try:
            yield tasks[which], future.result()
        except BrokenExecutor as error:
            if not stop.exists():
                yield tasks[which], error
        except HarnessError:
            raise
        except Exception:  # a task that could not even be sent or answered: its cells fail, the others go on
            failure = traceback.format_exc()
            yield tasks[which], [CellOutcome(str(cell), failure=failure) for cell in tasks[which].job.cells()]


def run_task(session: str, job: ClipTask, out: Path, stop: Path) -> list[CellOutcome]:
    """In a worker; BadInput when it is on a computer that does not have the folder."""
    if not (out / "cells").is_dir():
        raise BadInput(f"A worker on {node()} does not see {out}.", "Name a folder with --out that all workers share.")
    _start_session(session)
    return list(run_clip_task(job, out, stop))


@cache
def _start_session(session: str) -> None:
    """Workers that live on from another session have read files that may have changed."""
    clear_caches()


@cache
def _session_id() -> str:
    """One for each coordinator."""
    return f"{os.getpid()} {time.time_ns()}"


def split_task(task: CellTask) -> list[CellTask]:
    """A task for each of its cells."""
    job = task.job
    chosen = job.chosen or range(len(variants(job.scenario)))
    return [
        replace(task, job=replace(job, scenario=replace(job.scenario, methods=(m,), inputs=(i,)), chosen=(place,)))
        for place in chosen
        for i in job.scenario.inputs
        for m in job.scenario.methods
    ]


def _clip_jobs(scenario: Scenario, folder: Path | None, command: str) -> list[ClipTask]:
    parts = [ClipPart.parse(text) for text in scenario.motion.test]
    behaviours = scenario.motion.behaviours * (1 if len(scenario.motion.behaviours) > 1 else len(parts))
    where = folder and folder.absolute()  # workers may be anywhere
    return [ClipTask(scenario, part, b, where, command) for part, b in zip(parts, behaviours, strict=True)]


def _cells_per_variant(scenario: Scenario) -> int:
    return len(scenario.inputs) * len(scenario.methods)


def _split_evenly(what: Sequence[T], pieces: int) -> list[Sequence[T]]:
    """Pieces of nearly one size, no more than there is to share."""
    count = max(min(pieces, len(what)), 1)
    ends = [len(what) * n // count for n in range(count + 1)]
    return [what[start:stop] for start, stop in pairwise(ends)]
