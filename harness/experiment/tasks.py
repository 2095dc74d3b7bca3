"""The cells of scenarios, and the tasks that hold them.

A task is one test clip. It is simulated once for every combination of varied values, and every method reconstructs it
from every choice of inputs. Each of these is a cell.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeVar

from harness.core.split import ClipPart
from harness.experiment.methods.isolation import DEFAULT_ISOLATION, Isolation
from harness.experiment.scenarios.scenario import Scenario
from harness.mocap import LibraryFolders, absolute_folders
from harness.results import varied_text

T = TypeVar("T")

MAX_CELLS_PER_TASK = 200
"""Largest number of cells in one task. It bounds what a killed worker loses and how rarely a progress bar moves."""
_TASKS_PER_WORKER = 4
"""Number of tasks per worker that the last clips are cut into, so that workers end at nearly the same time."""


@dataclass(frozen=True)
class PlannedCell:
    """A cell before it is evaluated."""

    scenario: Scenario
    """The variant of the scenario: it has the values of `varied`."""
    varied: Mapping[str, Any]
    """Key -> its value, for each key that the scenario varies."""
    part: ClipPart
    method: str
    inputs: str
    label: str = ""
    """Name of the scenario in a folder of several scenarios."""

    @property
    def identity(self) -> dict[str, Any]:
        """What a cell states of its scenario, and what its key includes for that reason."""
        return {"varied": self.varied, "scenario": self.scenario.name}

    def __str__(self) -> str:
        """Name of the cell."""
        details = [text for text in (self.inputs, varied_text(self.varied)) if text not in ("", "pos+ori")]
        label = f"{self.label}: " if self.label else ""
        return f"{label}{self.method} on {self.part}" + (f" ({', '.join(details)})" if details else "")


def list_cells(
    scenario: Scenario, parts: Sequence[ClipPart], label: str, chosen: Collection[int] = ()
) -> list[PlannedCell]:
    """The cells of test clips in table order: variants change slowest, then clips, inputs and methods.

    `chosen` selects variants by index; () is all.
    """
    return [
        PlannedCell(variant, varied, part, method, inputs, label)
        for varied, variant in scenario.variants(chosen)
        for part in parts
        for inputs in variant.inputs
        for method in variant.methods
    ]


def cell_names(scenario: Scenario, *, labelled: bool = True) -> list[str]:
    """Names of all cells of a scenario in table order: varied values change slowest, then clips, inputs and methods.

    Without `labelled` the names leave out the scenario, as in the folder of a single run.
    """
    label = scenario.label if labelled else ""
    return [str(cell) for cell in list_cells(scenario, list(map(ClipPart.parse, scenario.motion.test)), label)]


@dataclass(frozen=True)
class ClipTask:
    """One test clip of a scenario: everything that a worker process needs."""

    scenario: Scenario
    part: ClipPart
    behaviour: str
    folder: LibraryFolders | None
    """The library of real motion."""
    command: str
    """The command that reproduces the run."""
    chosen: tuple[int, ...] = ()
    """Indices of the scenario's variants, () for all: several workers may share the variants of one clip."""
    label: str = ""
    """See `PlannedCell.label`."""
    isolation: Isolation = DEFAULT_ISOLATION

    @property
    def group(self) -> tuple[str, int, str, str]:
        """Tasks with equal groups share motion and training in one process."""
        return self.scenario.name, self.scenario.seed, str(self.part), self.behaviour

    def cells(self) -> list[PlannedCell]:
        """One for each combination of varied values, inputs and methods."""
        return list_cells(self.scenario, [self.part], self.label, self.chosen)


def plan_tasks(
    scenarios: Iterable[Scenario],
    folder: LibraryFolders | None,
    command: str,
    workers: int,
    *,
    labelled: bool = True,
    isolation: Isolation = DEFAULT_ISOLATION,
) -> list[ClipTask]:
    """Tasks that together hold every cell of the scenarios once.

    A task is a whole clip where possible, because its cells share motion and training. The last clips are cut into
    parts, so that all workers end at nearly the same time.
    """
    clips = [task for scenario in scenarios for task in _clip_tasks(scenario, folder, command, labelled, isolation)]
    shared = max(min(len(clips), workers), 1)
    tasks = []
    for place, task in enumerate(clips):
        count = task.scenario.count_variants()
        pieces = -(-_TASKS_PER_WORKER * workers // shared) if workers > 1 and place >= len(clips) - shared else 1
        cells_per_variant = len(task.scenario.inputs) * len(task.scenario.methods)
        pieces = max(pieces, -(-count * cells_per_variant // MAX_CELLS_PER_TASK))
        parts = (tuple(part) if len(part) < count else () for part in _split_evenly(range(count), pieces))
        tasks += [replace(task, chosen=chosen) for chosen in parts]
    pieces = -(-workers // max(len(tasks), 1))
    return [
        replace(task, scenario=replace(task.scenario, methods=_rotate(methods, place, workers)))
        for place, task in enumerate(tasks)
        for methods in _split_evenly(task.scenario.methods, pieces)
    ]


def split_task(task: ClipTask) -> list[ClipTask]:
    """One task for each cell of a task."""
    chosen = task.chosen or range(task.scenario.count_variants())
    return [
        replace(task, scenario=replace(task.scenario, methods=(method,), inputs=(inputs,)), chosen=(place,))
        for place in chosen
        for inputs in task.scenario.inputs
        for method in task.scenario.methods
    ]


def _clip_tasks(
    scenario: Scenario, folder: LibraryFolders | None, command: str, labelled: bool, isolation: Isolation
) -> list[ClipTask]:
    label = scenario.label if labelled else ""
    library = None if folder is None else absolute_folders(folder)  # a worker may have another working directory
    return [
        ClipTask(scenario, ClipPart.parse(clip), b, library, command, label=label, isolation=isolation)
        for clip, b in scenario.motion.tested
    ]


def _rotate(methods: Sequence[str], place: int, workers: int) -> tuple[str, ...]:
    """The methods, from another one on for each worker: in a first run each then compiles other functions."""
    start = place % workers * len(methods) // workers
    return (*methods[start:], *methods[:start])


def _split_evenly(items: Sequence[T], pieces: int) -> list[Sequence[T]]:
    """At most `pieces` parts of nearly equal size, none of them empty."""
    count = max(min(pieces, len(items)), 1)
    ends = [len(items) * n // count for n in range(count + 1)]
    return [items[start:stop] for start, stop in pairwise(ends)]
