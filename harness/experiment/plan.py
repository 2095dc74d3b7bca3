"""The plan of a run or sweep: everything that follows from its scenarios before the first cell is evaluated.

Names that do not exist are refused here, before anything is written and hours of work begin.
"""

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from harness.core.split import ClipPart
from harness.errors import BadInput, suggest
from harness.experiment.methods.isolation import DEFAULT_ISOLATION, Isolation
from harness.experiment.methods.method_table import MethodTable, find_methods
from harness.experiment.scenarios.motion_source import expand_clips, open_scenario_motion
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.tracker_checks import check_trackers
from harness.experiment.tasks import ClipTask, cell_names, plan_tasks, split_task
from harness.mocap import LibraryFolders, MotionSource
from harness.results import Manifest, describe_run

_CIRCUMSTANCE_KEYS = ("name", "methods", "expected_order", "left_out", "fault", "unit")
"""Keys of a scenario that are no inputs of a sweep; the name is in the scenario's label."""


@dataclass(frozen=True, eq=False)
class CellPlan:
    """Cells to evaluate."""

    names: tuple[str, ...]
    """Names of the cells, in table order."""
    tasks: tuple[ClipTask, ...]
    """The tasks that hold the cells."""
    sources: str
    """Hash of the source of the package and of all methods."""


@dataclass(frozen=True, eq=False)
class RunPlan:
    """What a run or sweep evaluates, and what its folder says of it."""

    kind: Literal["run", "sweep"]
    name: str
    command: str
    """The command that repeats it."""
    scenarios: tuple[Scenario, ...]
    """Without patterns in their clip lists."""
    names: tuple[str, ...]
    """Names of all cells, in table order."""
    cells: CellPlan
    """The cells that are evaluated now: all, or one."""
    manifest: Manifest

    def select(self, cell: str, out: Path) -> "RunPlan":
        """The plan of one cell alone, in the folder of all; BadInput."""
        for task in (single for whole in self.cells.tasks for single in split_task(whole)):
            if str(task.cells()[0]) == cell:
                return replace(self, cells=CellPlan((cell,), (task,), self.cells.sources))
        raise BadInput(
            f"No cell is called {cell!r}.{suggest(cell, self.names)}",
            f"`harness status {out}` names those that failed.",
        )


@dataclass(frozen=True)
class RunOptions:
    """How a run is computed; none of it changes what the run measures."""

    folder: LibraryFolders | None = None
    """The library of real motion; by default HARNESS_MOCAP."""
    workers: int = 1
    """Number of workers that tasks are cut for."""
    command: str = ""
    """The command that repeats the run."""
    isolation: Isolation = DEFAULT_ISOLATION
    """Which methods run in processes of their own, and the limits of these."""


def plan_run(scenario: Scenario, options: RunOptions) -> RunPlan:
    """Plan the run of one scenario; BadInput, UnknownName."""
    scenario = expand_clips(scenario, options.folder)
    content = scenario.content()
    del content["fault"]  # faults concern the emulator alone, a run does not depend on them
    return _plan("run", scenario.name, content, (scenario,), options)


def plan_sweep(name: str, scenarios: Sequence[Scenario], options: RunOptions) -> RunPlan:
    """Plan the run of the scenarios of a sweep of that name; BadInput, UnknownName."""
    inputs = {
        scenario.label: {key: value for key, value in scenario.content().items() if key not in _CIRCUMSTANCE_KEYS}
        for scenario in scenarios
    }
    content = {"sweep": name, "scenarios": inputs, "methods": _method_names(scenarios)}
    return _plan("sweep", name, content, tuple(scenarios), options)


def plan_cells(
    scenarios: Sequence[Scenario], options: RunOptions, methods: MethodTable | None = None, *, labelled: bool = True
) -> CellPlan:
    """Plan the cells of scenarios whose names were checked; BadInput when two cells have the same name.

    Without `labelled`, names of cells leave out the scenario.
    """
    methods = methods or find_methods(_method_names(scenarios), options.isolation)
    names = [name for scenario in scenarios for name in cell_names(scenario, labelled=labelled)]
    if len(set(names)) < len(names):
        twice = next(name for place, name in enumerate(names) if name in names[:place])
        raise BadInput(f"Two cells are called {twice!r}.", "Scenarios of other content need other names.")
    tasks = plan_tasks(
        scenarios, options.folder, options.command, options.workers, labelled=labelled, isolation=methods.isolation
    )
    return CellPlan(tuple(names), tuple(tasks), methods.sources)


def _plan(
    kind: Literal["run", "sweep"],
    name: str,
    content: Mapping[str, Any],
    scenarios: tuple[Scenario, ...],
    options: RunOptions,
) -> RunPlan:
    """`content` is what the manifest says of the scenarios."""
    isolation = replace(options.isolation, workers=min(options.workers, os.cpu_count() or 1))
    methods = check_names(scenarios, options.folder, isolation)
    cells = plan_cells(scenarios, options, methods, labelled=kind == "sweep")
    manifest = _describe(content, scenarios, methods, options)
    return RunPlan(kind, name, options.command, scenarios, cells.names, cells, manifest)


def _describe(
    content: Mapping[str, Any],
    scenarios: Sequence[Scenario],
    methods: MethodTable,
    options: RunOptions,
) -> Manifest:
    opened = [(open_scenario_motion(s.motion, options.folder, s.seed), s.motion.test) for s in scenarios]
    titles = list(dict.fromkeys(source.title for source, _ in opened))
    clips = {name: source for source, test in opened for name in (ClipPart.parse(text).clip for text in test)}
    return describe_run(
        content,
        motion_source=titles if "sweep" in content else titles[0],
        command=options.command,
        constants=methods.options,
        training_data=methods.training_data,
        performers={name: known for name, source in clips.items() if (known := source.performer(name))},
        unit="clip" if all(scenario.unit == "clip" for scenario in scenarios) else "performer",
    )


def check_names(
    scenarios: Collection[Scenario], folder: LibraryFolders | None, isolation: Isolation = DEFAULT_ISOLATION
) -> MethodTable:
    """Check that everything exists which the scenarios and their variants name; their methods.

    These are clips, methods, inputs, bones and components. UnknownName, BadInput.
    """
    variants = [variant for scenario in scenarios for _, variant in scenario.variants()]
    for variant in variants:
        _check_clips(variant.motion, open_scenario_motion(variant.motion, folder, variant.seed))
    methods = find_methods(_method_names(scenarios), isolation)
    for variant in variants:
        check_trackers(variant)
    return methods


def _check_clips(motion: ScenarioMotion, source: MotionSource) -> None:
    parts = {ClipPart.parse(text).clip for text in (*motion.test, *motion.withheld)}
    for name in parts | set(motion.examples):
        source.check(name)


def _method_names(scenarios: Iterable[Scenario]) -> list[str]:
    return list(dict.fromkeys(name for scenario in scenarios for name in scenario.methods))
