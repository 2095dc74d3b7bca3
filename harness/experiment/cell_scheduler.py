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
from harness.core.split import Part
from harness.errors import BadInput, HarnessError
from harness.experiment.cells import Ended, Job, Planned, Progress, forget_motion, run_job
from harness.experiment.executors import Each
from harness.experiment.interruption import stoppable
from harness.experiment.scenario import Scenario, variants
from harness.reconstruct import registry
from harness.results.index import CellIndex
from harness.results.manifest import source_hash

T = TypeVar("T")

MOST = 200
"""Cells in one task: what is lost of the index when the coordinator is killed, and how often a bar moves."""
_TASKS = 4
"""For each worker in the end, if there are cells enough: the last one to end does not keep the others waiting long."""


@dataclass(frozen=True)
class Cells:
    """What came of the cells that were asked for."""

    rows: tuple[Mapping[str, Any], ...]
    """Of those that finished, in planned order; as `results.cell.as_row` has them, and `seconds`."""
    failures: Mapping[str, str]
    """Cell -> why there is none: a refusal in one line, or a traceback."""
    planned: int


@dataclass(frozen=True)
class Task:
    """What a worker is given at once: some variants of a scenario on one clip, with some of its methods."""

    called: str
    """Goes before the names of its cells."""
    job: Job

    def cells(self) -> list[str]:
        return [f"{self.called}: {cell}" for cell in self.job.cells()]


def run_cells(
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    folder: Path | None,
    each: Each,
    command: str,
    progress: Progress = lambda cell, done, planned: None,
    workers: int | None = None,
) -> Cells:
    """Make every cell of the scenarios that the folder `out` does not have yet; BadInput when two would have one name.

    Tasks are cut for so many `workers`, by default as many as there are cores.

    A cell that fails stops no other. The first Ctrl-C lets cells finish that run and raises KeyboardInterrupt
    afterwards, the second one stops at once.
    """
    with CellIndex(out) as index:
        names = [name for scenario in scenarios for name in planned_cells(scenario)]
        tasks = tasks_of(scenarios, folder, command, workers or os.cpu_count() or 1)
        ended = work(index, names, tasks, out, each, progress)
        keys = [ended[name].key for name in names if name in ended and not ended[name].failure]
        failures = {name: ended[name].failure for name in names if name in ended and ended[name].failure}
        return Cells(tuple(index.rows_of(keys)), failures, len(names))


def called(scenario: Scenario) -> str:
    """What goes before the names of a scenario's cells."""
    return f"{scenario.name} seed {scenario.seed}"


def planned_cells(scenario: Scenario) -> list[str]:
    """Names of all its cells as tables list them: varied values change slowest, then clips, inputs and methods."""
    parts = [Part.parse(text) for text in scenario.motion.test]
    return [
        f"{called(scenario)}: {Planned(made, varied, part, method, inputs)}"
        for varied, made in variants(scenario)
        for part in parts
        for inputs in made.inputs
        for method in made.methods
    ]


def tasks_of(scenarios: Iterable[Scenario], folder: Path | None, command: str, workers: int) -> list[Task]:
    """Whole clips, whose cells share motion and learning; parts of the last ones, so that all workers end together."""
    whole = [(called(s), job, len(variants(s))) for s in scenarios for job in _jobs(s, folder, command)]
    shared = max(min(len(whole), workers), 1)
    tasks = []
    for place, (name, job, count) in enumerate(whole):
        pieces = -(-_TASKS * workers // shared) if place >= len(whole) - shared else 1
        pieces = max(pieces, -(-count * _width(job.scenario) // MOST))
        parts = (tuple(some) if len(some) < count else () for some in _shared(range(count), pieces))
        tasks += [Task(name, replace(job, chosen=chosen)) for chosen in parts]
    pieces = -(-workers // max(len(tasks), 1))
    return [
        replace(task, job=replace(task.job, scenario=replace(task.job.scenario, methods=tuple(some))))
        for task in tasks
        for some in _shared(task.job.scenario.methods, pieces)
    ]


def work(
    index: CellIndex, names: Sequence[str], tasks: Sequence[Task], out: Path, each: Each, progress: Progress
) -> dict[str, Ended]:
    """What became of each cell; see `run_cells`."""
    if len(set(names)) < len(names):
        twice = next(name for place, name in enumerate(names) if name in names[:place])
        raise BadInput(f"Two cells are called {twice!r}.", "Scenarios of other content need other names.")
    (out / "cells").mkdir(exist_ok=True)
    index.expect(names)
    sources, facts, failed = _sources(tasks), index.facts(), index.failures()
    index.reset(names if facts.get("sources") != sources else [name for name in names if name in failed])
    index.note(sources=sources, started_s=time.time(), made=0)
    stop, ended = out / f"{TEMPORARY}{os.getpid()}-stop", dict[str, Ended]()
    with stoppable(stop):
        broken = []
        for task, cells in _done(tasks, out, stop, each):
            if isinstance(cells, BrokenExecutor):
                broken.append(task)
                continue
            _keep(index, task, cells, ended, progress, len(names))
        alone = [one for task in broken for one in one_by_one(task)]  # but one of them may be to blame
        for task, cells in _done(alone, out, stop, each):
            if isinstance(cells, BrokenExecutor):
                cells = [Ended(str(cell), failure="a worker process died") for cell in task.job.cells()]
            _keep(index, task, cells, ended, progress, len(names))
    return ended


def _sources(tasks: Sequence[Task]) -> str:
    """Of all code at work: while it is as it was, what was finished counts as finished before it is looked at again."""
    names = sorted({name for task in tasks for name in task.job.scenario.methods})
    return content_key([source_hash(), [registry.source_hash(registry.resolve(name)) for name in names]])


def _keep(
    index: CellIndex, task: Task, cells: Sequence[Ended], ended: dict[str, Ended], progress: Progress, planned: int
) -> None:
    found = {f"{task.called}: {cell.cell}": cell for cell in cells}
    index.add((c.row for c in cells if c.row is not None), (c.seconds or None for c in cells if c.row is not None))
    index.ended((name, cell.key, cell.failure) for name, cell in found.items())
    for name, cell in found.items():
        ended[name] = replace(cell, row=None)  # it is in the index
        progress(name, len(ended), planned)
    made = sum(cell.seconds > 0.0 for cell in cells)
    index.note(made=index.facts()["made"] + made, seen_s=time.time())


def _done(
    tasks: Sequence[Task], out: Path, stop: Path, each: Each
) -> Iterator[tuple[Task, Sequence[Ended] | BrokenExecutor]]:
    if not tasks or stop.exists():
        return
    for which, future in each(run_task, [(_session(), task.job, out.absolute(), stop.absolute()) for task in tasks]):
        try:
            yield tasks[which], future.result()
        except BrokenExecutor as error:
            if not stop.exists():
                yield tasks[which], error
        except HarnessError:
            raise
        except Exception:  # a task that could not even be sent or answered: its cells fail, the others go on
            failure = traceback.format_exc()
            yield tasks[which], [Ended(str(cell), failure=failure) for cell in tasks[which].job.cells()]


def run_task(session: str, job: Job, out: Path, stop: Path) -> list[Ended]:
    """In a worker; BadInput when it is on a computer that does not have the folder."""
    if not (out / "cells").is_dir():
        raise BadInput(f"A worker on {node()} does not see {out}.", "Name a folder with --out that all workers share.")
    _begin(session)
    return list(run_job(job, out, stop))


@cache
def _begin(session: str) -> None:
    """Workers that live on from another session have read files that may have changed."""
    forget_motion()


@cache
def _session() -> str:
    """One for each coordinator."""
    return f"{os.getpid()} {time.time_ns()}"


def one_by_one(task: Task) -> list[Task]:
    """A task for each of its cells."""
    job = task.job
    chosen = job.chosen or range(len(variants(job.scenario)))
    return [
        replace(task, job=replace(job, scenario=replace(job.scenario, methods=(m,), inputs=(i,)), chosen=(place,)))
        for place in chosen
        for i in job.scenario.inputs
        for m in job.scenario.methods
    ]


def _jobs(scenario: Scenario, folder: Path | None, command: str) -> list[Job]:
    parts = [Part.parse(text) for text in scenario.motion.test]
    behaviours = scenario.motion.behaviours * (1 if len(scenario.motion.behaviours) > 1 else len(parts))
    where = folder and folder.absolute()  # workers may be anywhere
    return [Job(scenario, part, b, where, command) for part, b in zip(parts, behaviours, strict=True)]


def _width(scenario: Scenario) -> int:
    return len(scenario.inputs) * len(scenario.methods)


def _shared(what: Sequence[T], pieces: int) -> list[Sequence[T]]:
    """Pieces of nearly one size, no more than there is to share."""
    count = max(min(pieces, len(what)), 1)
    ends = [len(what) * n // count for n in range(count + 1)]
    return [what[start:stop] for start, stop in pairwise(ends)]
