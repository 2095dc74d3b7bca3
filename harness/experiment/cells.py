"""Cells: how one is planned, evaluated and written, and its outcome.

A task is one test clip. It is simulated once for every combination of varied values, and every method reconstructs it
from every choice of inputs. Each of these is a cell. A cell is written whole or not at all, so that a task can be
stopped at any moment and resumed.
"""

import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import pairwise
from pathlib import Path
from platform import node
from typing import Any, TypeVar

import numpy as np

from harness.body.mounts import locate_mount
from harness.core.fault_report import named_folder_fault
from harness.core.humanoid24 import standard_skeleton
from harness.core.split import ClipPart
from harness.core.stream_health import BAUD, RECORD_BYTES, excess_loss
from harness.errors import BadInput, HarnessError, UnknownName
from harness.experiment.clip_evaluation import ClipEvaluation, mounts_of, noise_of
from harness.experiment.evaluation import evaluate
from harness.experiment.methods.isolation import DEFAULT_ISOLATION, Isolation
from harness.experiment.methods.method_process import MethodFailure
from harness.experiment.methods.method_run import describe_failure
from harness.experiment.methods.remote_method import close_methods, resolve_method, start_methods
from harness.experiment.observed_take import simulated_take
from harness.experiment.scenario import Scenario, ScenarioMotion, count_variants, variants
from harness.mocap.library import LibraryFolders, absolute_folders
from harness.mocap.sources import MotionSource, open_motion_source
from harness.reconstruct.contract import Method
from harness.results import manifest, storage
from harness.results.cell import as_row, cell_folder, read_row, varied_text
from harness.score.loops import COVERAGE_FLOOR
from harness.score.score import score_estimate
from harness.simulate.physics.constellation import load_constellation
from harness.simulate.physics.room import check_emitters
from harness.stream.codec.items import record_size
from harness.stream.codec.reader import WireFormat
from harness.stream.inputs import make_inputs

VariedValues = Mapping[str, Any]
_ANSWERS = ("angle_sigma_rad", "status", "origin", "step_ms", "step_cpu_ms", "reference_cpu_ms")
_READINGS = {"quality": float, "position_valid": bool, "orientation_valid": bool, "suspect": bool}
"""Fields of a method's answers and of frames that a cell has under the same names, of frames with their type."""


@dataclass(frozen=True)
class PlannedCell:
    """A cell before it is evaluated."""

    scenario: Scenario
    """The variant of the scenario: the varied values are put in."""
    varied: VariedValues
    part: ClipPart
    method: str
    inputs: str
    label: str = ""
    """Name of the scenario in a folder of several scenarios."""

    def __str__(self) -> str:
        """Name of the cell."""
        details = [text for text in (self.inputs, varied_text(self.varied)) if text not in ("", "pos+ori")]
        label = f"{self.label}: " if self.label else ""
        return f"{label}{self.method} on {self.part}" + (f" ({', '.join(details)})" if details else "")


def plan_cells(
    scenario: Scenario, parts: Sequence[ClipPart], label: str, chosen: Collection[int] = ()
) -> list[PlannedCell]:
    """The cells of test clips in table order: variants change slowest, then clips, inputs and methods.

    `chosen` selects variants by index; () is all.
    """
    return [
        PlannedCell(variant, varied, part, method, inputs, label)
        for varied, variant in variants(scenario, chosen)
        for part in parts
        for inputs in variant.inputs
        for method in variant.methods
    ]


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
        return plan_cells(self.scenario, [self.part], self.label, self.chosen)


@dataclass(frozen=True)
class CellOutcome:
    """Outcome of one cell."""

    cell: str
    """Name of the cell."""
    key: str = ""
    """Key of the finished cell, "" if it failed."""
    failure: str = ""
    """A refusal in one line or a traceback, "" if the cell is finished."""
    refused: bool = False
    row: Mapping[str, Any] | None = None
    """Row of the finished cell, as `results.cell.as_row` gives it; also of a cell that was finished before."""
    seconds: float = 0.0
    """Wall time of this cell and of what it prepared for later cells [s]; 0 if it was finished before."""


def run_task(session: str, task: ClipTask, out: Path, stop: Path) -> Iterator[CellOutcome]:
    """Run the cells of one task in order, and yield each outcome; it ends early once the file `stop` exists.

    BadInput on a computer that does not see the folder `out`. ExampleLeak, which ends the run, when a test clip is
    among its own examples. Workers clear their caches for each new `session`.
    """
    if not (out / "cells").is_dir():
        raise BadInput(f"A worker on {node()} does not see {out}.", "Name a folder with --out that all workers share.")
    _start_session(session)
    for cell in task.cells():
        if stop.exists():
            return
        start = time.perf_counter()
        try:
            evaluation, method = _clip_evaluation(task, cell.scenario), _cached_method(cell.method, task.isolation)
            key = evaluation.key(method, cell.method, cell.inputs, cell.varied)
            if storage.has_cell(out, key):
                yield CellOutcome(str(cell), key, row=read_row(cell_folder(out, key)))
                continue
            evaluated = evaluate_cell(evaluation, method, cell, key, task.command)
            _write_cell(out, evaluated)
            yield CellOutcome(str(cell), key, row=as_row(evaluated), seconds=time.perf_counter() - start)
        except (Exception, SystemExit) as error:  # a method may raise anything: its cell alone fails
            refused = isinstance(error, HarnessError) and not isinstance(error, MethodFailure)
            yield CellOutcome(str(cell), failure=describe_failure(error), refused=refused)


def _write_cell(out: Path, cell: storage.Cell) -> None:
    """Write a cell; SystemFault when the system refuses, which is no failure of the cell: all others would fail too."""
    with named_folder_fault(out):
        if not out.is_dir():  # it would be made anew, for one cell
            raise FileNotFoundError(out)
        storage.write_cell(out, cell)


@cache
def _start_session(session: str) -> None:
    """A worker may live on from another session, and files that it has read may have changed since."""
    clear_caches()


_recent_evaluations: list[ClipEvaluation] = []
"""The last evaluation of this process: the next cell may be of the same clip."""


def _clip_evaluation(task: ClipTask, scenario: Scenario) -> ClipEvaluation:
    """The evaluation of a task's clip, which shares with the last one what does not differ."""
    source, evaluation = open_scenario_motion(scenario.motion, task.folder, scenario.seed), None
    for last in _recent_evaluations:
        if last.source is source and (last.part, last.behaviour) == (task.part, task.behaviour):
            evaluation = last if last.scenario == scenario else last.with_conditions(scenario)
    _recent_evaluations[:] = [evaluation or ClipEvaluation(scenario, source, task.part, task.behaviour)]
    return _recent_evaluations[0]


@cache
def _cached_method(name: str, isolation: Isolation) -> Method:
    """The method of that name. Searching the installed packages takes longer than writing a cell, hence the cache."""
    return resolve_method(name, isolation)


def evaluate_cell(
    evaluation: ClipEvaluation, method: Method, planned: PlannedCell, key: str, command: str
) -> storage.Cell:
    """Fit a method, run it over the simulated stream, and score its estimates at the frames that they answer.

    A method with a lag leaves the last frames of the take unanswered: the cell has no rows for them. Its lag is one of
    the conditions, because its errors and those of a causal method are not comparable. Nothing is measured where the
    line drops too many records and the scenario does not allow the overload.
    """
    scenario, simulation, calibration = evaluation.scenario, evaluation.simulation, evaluation.performer_calibration
    found = evaluate(method, planned.method, simulated_take(evaluation, planned.inputs))
    (loop,), lag = found.take.loops, found.lag
    kept = loop.rows < len(found.answers.qpos)
    rows, frame_index = loop.rows[kept], loop.index[kept]
    answers, frames, health = found.answers.at(rows), [simulation.frames[row] for row in rows], simulation.health
    too_slow = excess_loss(health, allowed=scenario.tracker.overload) > 0.0
    if too_slow:
        health = health | {RECORD_BYTES: record_size(scenario.tracker.items), BAUD: scenario.tracker.baud}
    shape = len(frames), len(simulation.stations)  # also of no frame at all
    readings = {n: np.array([getattr(f, n) for f in frames], kind).reshape(shape) for n, kind in _READINGS.items()}
    scores = score_estimate(
        evaluation.body.skeleton,
        scenario.tracker.rate_hz,
        simulation.truth_qpos,
        answers.qpos,
        frame_index,
        answers.status,
        answers.step_ms,
        origin=answers.origin,
        complete=(readings["position_valid"] & readings["orientation_valid"]).all(axis=1),
        cpu_ms=(answers.step_cpu_ms, answers.reference_cpu_ms),
        angle_sigma_rad=answers.angle_sigma_rad,
        estimate_skeleton=calibration.body.skeleton,
        floor=np.inf if too_slow else COVERAGE_FLOOR,
    )
    return storage.Cell(
        key=key,
        method=planned.method,
        behaviour=evaluation.behaviour,
        clip=str(evaluation.part),
        motion_source=evaluation.source.title,
        stations=simulation.stations,
        mount=scenario.mount,
        rate_hz=scenario.tracker.rate_hz,
        inputs=planned.inputs,
        split=scenario.motion.split if method.needs_examples else "none",
        calibration=calibration.calibration.kind,
        noise=scenario.noise_label,
        seed=scenario.seed,
        performer=evaluation.subject.performer,
        varied=planned.varied,
        scenario=scenario.name,
        defined_by=evaluation.conditions_of(method, planned.inputs) | ({"lag": lag} if lag else {}),
        scores=scores,
        health=health,
        calibration_errors=calibration.errors,
        bone_m=evaluation.body.skeleton.bone_m,
        estimate_bone_m=calibration.body.skeleton.bone_m,
        source_hash=manifest.source_hash(),
        reproduce=command,
        notes=evaluation.notes(method),
        time_s=simulation.truth_s[frame_index],
        truth_qpos=simulation.truth_qpos[frame_index],
        estimate_qpos=answers.qpos,
        frame_index=frame_index,
        **{name: getattr(answers, name) for name in _ANSWERS},
        **readings,
    )


def open_scenario_motion(motion: ScenarioMotion, folder: LibraryFolders | None, seed: int) -> MotionSource:
    """The motion that a scenario names; BadInput when it needs a library and none is named."""
    return _cached_source(motion.source, folder, seed, motion.rate_hz or None)


def clear_caches() -> None:
    """Forget motion, methods and evaluations, and end the processes of methods: files may have changed since."""
    _cached_source.cache_clear()
    _cached_method.cache_clear()
    close_methods()
    _recent_evaluations.clear()


@lru_cache(maxsize=2)
def _cached_source(kind: str, folder: LibraryFolders | None, seed: int, rate_hz: float | None) -> MotionSource:
    """One source for all clips of a run, which share examples."""
    return open_motion_source(kind, folder, seed=seed, rate_hz=rate_hz)


def check_names(
    scenarios: Collection[Scenario], folder: LibraryFolders | None, isolation: Isolation = DEFAULT_ISOLATION
) -> None:
    """Check that everything exists which the scenarios and their variants name, before hours of work begin.

    These are clips, methods, inputs, bones and components. UnknownName, BadInput.
    """
    for scenario in scenarios:
        start_methods(scenario.methods, isolation)
    for scenario in scenarios:
        for _, variant in variants(scenario):
            _check_variant_names(variant, open_scenario_motion(variant.motion, folder, variant.seed), isolation)


def _check_variant_names(scenario: Scenario, source: MotionSource, isolation: Isolation) -> None:
    parts = {ClipPart.parse(text).clip for text in (*scenario.motion.test, *scenario.motion.withheld)}
    for name in parts | set(scenario.motion.examples):
        source.check(name)
    for name in scenario.methods:
        with suppress(MethodFailure):  # its cells fail, those of other methods are run
            _cached_method(name, isolation)
    for name in scenario.inputs:
        make_inputs(name, tuple(scenario.worn_stations))
    WireFormat(tuple(scenario.worn_stations), scenario.tracker.rate_hz, scenario.tracker.items)
    for mount in mounts_of(scenario):
        locate_mount(standard_skeleton(), mount)
    noise = scenario.disturbance.add_to(noise_of(scenario), tuple(scenario.worn_stations))
    for slip in noise.mount_slip:
        if slip.station not in scenario.stations:
            raise UnknownName("station", slip.station, scenario.stations)
    if noise.physics is not None:
        emitters = load_constellation(noise.physics.constellation)
        check_emitters(noise.physics.room, scenario.tracker.origin_m[2], emitters.number, emitters.position_m)


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
