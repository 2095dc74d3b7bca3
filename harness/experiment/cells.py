"""Cells: which there are, how one is made, and what became of it.

A job is one test clip: simulated once for every combination of varied values, then shown to every method with every
choice of inputs. Each of these is a cell, written whole or not at all, so that whoever runs jobs can be stopped at any
moment and goes on where they were.
"""

import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from harness.body.mounts import locate_mount
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.humanoid24 import standard_skeleton
from harness.core.split import ClipPart
from harness.errors import HarnessError, was_interrupted
from harness.experiment.clip_evaluation import ClipEvaluation, mounts_of, noise_of
from harness.experiment.reference_workload import FRAMES_PER_TIMING, ReferenceWorkload
from harness.experiment.scenario import Scenario, ScenarioMotion, variants
from harness.mocap.sources import MotionSource, open_motion_source
from harness.reconstruct import registry
from harness.reconstruct.contract import Method, Reconstructor
from harness.results import manifest, storage
from harness.results.cell import as_row, cell_folder, read_row, varied_text
from harness.score.score import score_estimate
from harness.simulate.simulation import Simulation
from harness.stream.codec.reader import WireFormat
from harness.stream.inputs import Inputs, make_inputs

ProgressCallback = Callable[[str, int, int], None]
"""Called with what was done last, how many cells are finished and how many were planned."""


VariedValues = Mapping[str, Any]


@dataclass(frozen=True)
class PlannedCell:
    """One cell to come."""

    scenario: Scenario
    """With the varied values put in."""
    varied: VariedValues
    part: ClipPart
    method: str
    inputs: str

    def __str__(self) -> str:
        """What the cell is called."""
        besides = [text for text in (self.inputs, varied_text(self.varied)) if text not in ("", "pos+ori")]
        return f"{self.method} on {self.part}" + (f" ({', '.join(besides)})" if besides else "")


@dataclass(frozen=True)
class ClipTask:
    """One test clip of a scenario; everything a worker process needs to know."""

    scenario: Scenario
    part: ClipPart
    behaviour: str
    folder: Path | None
    """The library of real motion."""
    command: str
    """The command that reproduces the run."""
    chosen: tuple[int, ...] = ()
    """Which of the scenario's variants, () for all: several workers may share the variants of one clip."""

    def cells(self) -> list[PlannedCell]:
        """One for each combination of varied values, inputs and methods."""
        return [
            PlannedCell(scenario, varied, self.part, method, inputs)
            for varied, scenario in variants(self.scenario, self.chosen)
            for inputs in scenario.inputs
            for method in scenario.methods
        ]


@dataclass(frozen=True)
class CellOutcome:
    """What became of one cell."""

    cell: str
    key: str = ""
    """Of the finished cell."""
    failure: str = ""
    """Why there is none: a refusal in one line, or a traceback."""
    refused: bool = False
    row: Mapping[str, Any] | None = None
    """Of the finished cell, as `results.cell.as_row` has it; also of one that was finished before."""
    seconds: float = 0.0
    """It took here, with what it made for the cells after it [s]; 0 for one that was finished before."""


def run_clip_task(job: ClipTask, out: Path, stop: Path | None = None) -> Iterator[CellOutcome]:
    """Every cell of one clip, in order; a failure is reported in its place. It ends early once the file `stop` is."""
    for cell in job.cells():
        if stop is not None and stop.exists():
            return
        start = time.perf_counter()
        try:
            setting, method = _clip_evaluation(job, cell.scenario), _resolve_method(cell.method)
            key = setting.key(method, cell.method, cell.inputs, cell.varied)
            if storage.has_cell(out, key):
                yield CellOutcome(str(cell), key, row=read_row(cell_folder(out, key)))
                continue
            made = evaluate_cell(setting, method, cell, key, job.command)
            storage.write_cell(out, made)
            yield CellOutcome(str(cell), key, row=as_row(made), seconds=time.perf_counter() - start)
        except HarnessError as error:
            yield CellOutcome(str(cell), failure=str(error), refused=True)
        except (Exception, SystemExit) as error:  # a method may raise anything: its cell fails, the run goes on
            if was_interrupted(error):
                raise KeyboardInterrupt from error
            yield CellOutcome(str(cell), failure=traceback.format_exc())


_recent_evaluations: list[ClipEvaluation] = []
"""What this process worked at, for the next job may be of the same clip."""


def _clip_evaluation(job: ClipTask, scenario: Scenario) -> ClipEvaluation:
    """Shares with the one before what may be shared."""
    source, now = open_scenario_motion(scenario.motion, job.folder, scenario.seed), None
    for last in _recent_evaluations:
        if last.source is source and (last.part, last.behaviour) == (job.part, job.behaviour):
            now = last if last.scenario == scenario else last.with_conditions(scenario)
    _recent_evaluations[:] = [now or ClipEvaluation(scenario, source, job.part, job.behaviour)]
    return _recent_evaluations[0]


@cache
def _resolve_method(name: str) -> Method:
    """Whatever package it is of: to look through all that are installed takes longer than to write a cell."""
    return registry.resolve(name)


def evaluate_cell(
    setting: ClipEvaluation, method: Method, planned: PlannedCell, key: str, command: str
) -> storage.Cell:
    """Fit, run causally over the stream, score."""
    scenario, simulation = setting.scenario, setting.simulation
    seen = make_inputs(planned.inputs, simulation.stations)
    known, fitted = setting.performer_calibration, setting.fit_method(method, planned.method)
    qpos, status, step_ms, cpu_ms = run_method(fitted, known.calibration, simulation, seen)
    scores = score_estimate(
        setting.body.skeleton,
        scenario.tracker.rate_hz,
        simulation.truth_qpos,
        qpos,
        simulation.frame_index,
        status,
        step_ms,
        cpu_ms=cpu_ms,
        estimate_skeleton=known.body.skeleton,
    )
    frames = simulation.frames
    return storage.Cell(
        key=key,
        method=planned.method,
        behaviour=setting.behaviour,
        clip=str(setting.part),
        motion_source=setting.source.title,
        stations=simulation.stations,
        mount=scenario.mount,
        rate_hz=scenario.tracker.rate_hz,
        inputs=planned.inputs,
        split=scenario.motion.split if method.needs_examples else "none",
        calibration=known.calibration.kind,
        noise=scenario.profile or scenario.noise + ("*" if scenario.components else ""),
        seed=scenario.seed,
        performer=setting.performer,
        varied=planned.varied,
        scenario=scenario.name,
        defined_by=setting.conditions_of(method, planned.inputs),
        scores=scores,
        health=simulation.health,
        calibration_errors=known.errors,
        bone_m=setting.body.skeleton.bone_m,
        estimate_bone_m=known.body.skeleton.bone_m,
        source_hash=manifest.source_hash(),
        reproduce=command,
        notes=setting.notes(method),
        time_s=simulation.truth_s[simulation.frame_index],
        truth_qpos=simulation.truth_qpos[simulation.frame_index],
        estimate_qpos=qpos,
        frame_index=simulation.frame_index,
        status=status,
        step_ms=step_ms,
        step_cpu_ms=cpu_ms[0],
        reference_cpu_ms=cpu_ms[1],
        quality=np.array([f.quality for f in frames]),
        position_valid=np.array([f.position_valid for f in frames]),
        orientation_valid=np.array([f.orientation_valid for f in frames]),
        suspect=np.array([f.suspect for f in frames]),
    )


def run_method(
    reconstructor: Reconstructor, calibration: Calibration, simulation: Simulation, inputs: Inputs
) -> tuple[Floats, Ints, Floats, tuple[Floats, Floats]]:
    """Estimates (F, 55), status (F,), wall time of each step (F,), CPU time of each and of the reference (F,) [ms].

    Reference work follows every so many steps. The step after it finds the method's data gone from the caches and is
    not timed, NaN: times are of steps that follow a step. The truth stays on this side.
    """
    session, work = reconstructor.begin(calibration), ReferenceWorkload()
    qpos, status, step_ms, cpu_ms, reference_ms = [], [], [], [], []
    for index, frame in enumerate(simulation.frames):
        shown = inputs.mask(frame)
        start_cpu, start = time.process_time(), time.perf_counter()
        estimate = session.step(shown)
        step_ms.append(1e3 * (time.perf_counter() - start))
        cpu_ms.append(1e3 * (time.process_time() - start_cpu))
        qpos.append(estimate.qpos)
        status.append(estimate.status)
        reference_ms.append(work.cpu_ms() if index % FRAMES_PER_TIMING == FRAMES_PER_TIMING - 1 else np.nan)
    times_ms = np.array([step_ms, cpu_ms, reference_ms])
    times_ms[:2, FRAMES_PER_TIMING::FRAMES_PER_TIMING] = np.nan
    return np.array(qpos), np.array(status), times_ms[0], (times_ms[1], times_ms[2])


def open_scenario_motion(motion: ScenarioMotion, folder: Path | None, seed: int) -> MotionSource:
    """The motion that a scenario names; BadInput when it needs a library and none is named."""
    return _cached_source(motion.source, folder, seed, motion.rate_hz or None)


def clear_caches() -> None:
    """Whoever begins a run calls this: files may have changed since the last one."""
    _cached_source.cache_clear()
    _resolve_method.cache_clear()
    _recent_evaluations.clear()


@lru_cache(maxsize=2)
def _cached_source(kind: str, folder: Path | None, seed: int, rate_hz: float | None) -> MotionSource:
    """One for all the clips of a run: they share examples."""
    return open_motion_source(kind, folder, seed=seed, rate_hz=rate_hz)


def check_names(scenario: Scenario, source: MotionSource, parts: list[ClipPart]) -> None:
    """Everything that a scenario names exists: clips, methods, inputs, bones, components. UnknownName, BadInput."""
    withheld = {ClipPart.parse(text).clip for text in scenario.motion.withheld}
    for name in {part.clip for part in parts} | set(scenario.motion.examples) | withheld:
        source.check(name)
    for name in scenario.methods:
        _resolve_method(name)
    for name in scenario.inputs:
        make_inputs(name, tuple(scenario.worn_stations))
    WireFormat(tuple(scenario.worn_stations), scenario.tracker.rate_hz, scenario.tracker.items)
    for mount in mounts_of(scenario):
        locate_mount(standard_skeleton(), mount)
    scenario.disturbance.add_to(noise_of(scenario), tuple(scenario.worn_stations))
