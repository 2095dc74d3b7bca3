"""Planning: the cells of scenarios, their names in the order of tables, and the tasks that workers are given."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TypeVar

from harness.core.split import ClipPart
from harness.experiment.cells import ClipTask, plan_cells
from harness.experiment.isolation import DEFAULT_ISOLATION, Isolation
from harness.experiment.scenario import Scenario, count_variants
from harness.mocap.library import LibraryFolders, absolute_folders

T = TypeVar("T")

MAX_CELLS_PER_TASK = 200
"""Largest number of cells in one task. It bounds what a killed worker loses and how rarely a progress bar moves."""
_TASKS_PER_WORKER = 4
"""Number of tasks per worker that the last clips are cut into, so that workers end at nearly the same time."""


def scenario_label(scenario: Scenario) -> str:
    """Label of a scenario in a folder of several; it precedes the names of the scenario's cells."""
    return f"{scenario.name} seed {scenario.seed}"


def cell_names(scenario: Scenario, *, labelled: bool = True) -> list[str]:
    """Names of all cells of a scenario in table order: varied values change slowest, then clips, inputs and methods.

    Without `labelled` the names leave out the scenario, as in the folder of a single run.
    """
    label = scenario_label(scenario) if labelled else ""
    return [str(cell) for cell in plan_cells(scenario, list(map(ClipPart.parse, scenario.motion.test)), label)]


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
        count = count_variants(task.scenario)
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
    chosen = task.chosen or range(count_variants(task.scenario))
    return [
        replace(task, scenario=replace(task.scenario, methods=(method,), inputs=(inputs,)), chosen=(place,))
        for place in chosen
        for inputs in task.scenario.inputs
        for method in task.scenario.methods
    ]


def _clip_tasks(
    scenario: Scenario, folder: LibraryFolders | None, command: str, labelled: bool, isolation: Isolation
) -> list[ClipTask]:
    label = scenario_label(scenario) if labelled else ""
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
