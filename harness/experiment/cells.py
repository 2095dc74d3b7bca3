"""Cells: how one is evaluated and written, and its outcome.

A cell is written whole or not at all, so that a task can be stopped at any moment and resumed. Cells of one process
share motion, methods and, as far as their conditions agree, the evaluation of their clip.
"""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from platform import node
from typing import Any

import numpy as np

from harness.core.fault_report import named_folder_fault
from harness.core.stream_health import BAUD, READING_AGE, RECORD_BYTES, excess_loss, mean_reading_age_s
from harness.errors import BadInput, HarnessError
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.evaluation import evaluate
from harness.experiment.methods.method_process import MethodFailure
from harness.experiment.methods.method_run import describe_failure
from harness.experiment.methods.remote_method import close_methods, find_method
from harness.experiment.observed_take import simulated_take
from harness.experiment.scenarios.motion_source import forget_motion, open_scenario_motion
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.tasks import ClipTask, PlannedCell
from harness.reconstruct import Method
from harness.results import Cell, as_row, cell_folder, has_cell, read_row, source_hash, write_cell
from harness.score import COVERAGE_FLOOR, score_estimate
from harness.stream.polhemus.codec import record_size

_ANSWERS = ("angle_sigma_rad", "status", "origin", "step_ms", "step_cpu_ms", "reference_cpu_ms")
_READINGS = {"quality": float, "position_valid": bool, "orientation_valid": bool, "suspect": bool}
"""Fields of a method's answers and of frames that a cell has under the same names, of frames with their type."""


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
            evaluation, method = _clip_evaluation(task, cell.scenario), find_method(cell.method, task.isolation).method
            key = evaluation.key(method, cell.method, cell.inputs, cell.identity)
            if has_cell(out, key):
                yield CellOutcome(str(cell), key, row=read_row(cell_folder(out, key)))
                continue
            evaluated = evaluate_cell(evaluation, method, cell, key, task.command)
            _write_cell(out, evaluated)
            yield CellOutcome(str(cell), key, row=as_row(evaluated), seconds=time.perf_counter() - start)
        except (Exception, SystemExit) as error:  # a method may raise anything: its cell alone fails
            refused = isinstance(error, HarnessError) and not isinstance(error, MethodFailure)
            yield CellOutcome(str(cell), failure=describe_failure(error), refused=refused)


def _write_cell(out: Path, cell: Cell) -> None:
    """Write a cell; SystemFault when the system refuses, which is no failure of the cell: all others would fail too."""
    with named_folder_fault(out):
        if not out.is_dir():  # it would be made anew, for one cell
            raise FileNotFoundError(out)
        write_cell(out, cell)


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


def evaluate_cell(evaluation: ClipEvaluation, method: Method, planned: PlannedCell, key: str, command: str) -> Cell:
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
    if scenario.tracker.overload and frames:
        age_s = mean_reading_age_s(np.array([frame.measured_s for frame in frames]), 1.0 / scenario.tracker.rate_hz)
        health = health | {READING_AGE: 1e3 * age_s} if np.isfinite(age_s) else health
    readings: dict[str, Any] = {
        name: np.array([getattr(frame, name) for frame in frames], kind).reshape(shape)
        for name, kind in _READINGS.items()
    }
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
    return Cell(
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
        **planned.identity,
        defined_by=evaluation.conditions_of(method, planned.inputs) | ({"lag": lag} if lag else {}),
        scores=scores,
        health=health,
        calibration_errors=calibration.errors,
        bone_m=evaluation.body.skeleton.bone_m,
        estimate_bone_m=calibration.body.skeleton.bone_m,
        source_hash=source_hash(),
        reproduce=command,
        notes=evaluation.notes(method),
        time_s=simulation.truth_s[frame_index],
        truth_qpos=simulation.truth_qpos[frame_index],
        estimate_qpos=answers.qpos,
        frame_index=frame_index,
        **{name: getattr(answers, name) for name in _ANSWERS},
        **readings,
    )


def clear_caches() -> None:
    """Forget motion, methods and evaluations, and end the processes of methods: files may have changed since."""
    forget_motion()
    close_methods()
    _recent_evaluations.clear()
