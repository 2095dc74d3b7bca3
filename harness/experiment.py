"""The whole loop: mocap -> body -> simulate -> calibrate -> reconstruct -> score -> report, cell by cell.

A job is one test clip: simulated once for every combination of varied values, then shown to every method with every
choice of inputs. Each of these is a cell, written whole or not at all, so that a run can be stopped at any moment
and goes on where it was.
"""

import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import BrokenExecutor
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from harness.body.mounts import place
from harness.config import Motion, Scenario, variants
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.humanoid24 import standard_skeleton
from harness.core.protocol import Part
from harness.core.workers import call_each
from harness.errors import BadInput, HarnessError, Outcome, was_interrupted
from harness.mocap.sources import MotionSource, open_source
from harness.reconstruct import registry
from harness.reconstruct.contract import Method, Reconstructor
from harness.score import manifest, results
from harness.score.cell import varied_text
from harness.score.score import score
from harness.setting import Setting, mounts_of, noise_of
from harness.simulate.simulate import Simulation
from harness.stream.inputs import Inputs, combination
from harness.stream.reader import WireFormat

Progress = Callable[[str, int, int], None]
"""Called with what was done last, how many cells are finished and how many were planned."""


Varied = Mapping[str, Any]


@dataclass(frozen=True)
class Planned:
    """One cell to come."""

    scenario: Scenario
    """With the varied values put in."""
    varied: Varied
    part: Part
    method: str
    inputs: str

    def __str__(self) -> str:
        """What the cell is called."""
        besides = [text for text in (self.inputs, varied_text(self.varied)) if text not in ("", "pos+ori")]
        return f"{self.method} on {self.part}" + (f" ({', '.join(besides)})" if besides else "")


@dataclass(frozen=True)
class Job:
    """One test clip of a scenario; everything a worker process needs to know."""

    scenario: Scenario
    part: Part
    behaviour: str
    folder: Path | None
    """The library of real motion."""
    command: str
    """The command that reproduces the run."""

    def cells(self) -> list[Planned]:
        """One for each combination of varied values, inputs and methods."""
        return [
            Planned(scenario, varied, self.part, method, inputs)
            for varied, scenario in variants(self.scenario)
            for inputs in scenario.inputs
            for method in scenario.methods
        ]


@dataclass(frozen=True)
class Ended:
    """What became of one cell."""

    cell: str
    key: str = ""
    """Of the finished cell."""
    failure: str = ""
    """Why there is none: a refusal in one line, or a traceback."""
    refused: bool = False


def run(
    scenario: Scenario,
    out: Path,
    *,
    folder: Path | None = None,
    jobs: int = 1,
    command: str = "",
    progress: Progress = lambda cell, done, planned: None,
) -> Outcome:
    """Run what is not finished yet, and write summary.json and summary.csv of all of it.

    `out` is made, or resumed when it holds this very scenario, else refused (BadInput). A cell that fails is
    listed with its traceback and never stops the rest; when nothing but refusals came out, the first one is raised.
    NOT_COMPARABLE when every cell came below the floor of coverage, so that nothing was measured.
    Names that do not exist are refused before anything is written.
    """
    _opened.cache_clear()  # files may have changed since the last run
    parts = [Part.parse(text) for text in scenario.motion.test]
    behaviours = scenario.motion.behaviours * (1 if len(scenario.motion.behaviours) > 1 else len(parts))
    todo = [Job(scenario, part, b, folder, command) for part, b in zip(parts, behaviours, strict=True)]
    for _, made in reversed(variants(scenario)):
        source = source_of(made.motion, folder, made.seed)
        check_names(made, source, parts)
    content = asdict(scenario)
    del content["fault"]  # of an emulator alone: a run is the same with and without
    constants = {name: repr(registry.resolve(name)) for name in scenario.methods}
    described = manifest.of_run(content, motion_source=source.title, command=command, constants=constants)
    results.open_run(out, described)
    planned = _in_order(todo)
    ended: dict[str, Ended] = {}
    try:
        for cell in _cells(todo, out, jobs):
            ended[cell.cell] = cell
            progress(cell.cell, len(ended), len(planned))
    finally:
        in_order = [ended[cell] for cell in planned if cell in ended]
        failed = {cell.cell: cell.failure for cell in in_order if cell.failure}
        keys = [cell.key for cell in in_order if not cell.failure]
        summary = results.write_summary(out, keys=keys, planned=len(planned), failures=failed, orders=scenario.order)
    if failed and all(cell.refused for cell in in_order):
        raise BadInput(f"Nothing could be run. {next(iter(failed.values()))}", "")
    if failed:
        return Outcome.INCOMPLETE
    measured = any(row["joint_angle_mean_deg"] is not None for row in summary["cells"])
    return Outcome.PASS if measured else Outcome.NOT_COMPARABLE


def source_of(motion: Motion, folder: Path | None, seed: int) -> MotionSource:
    """The motion that a scenario names; BadInput when it needs a library and none is named."""
    return _opened(motion.source, folder, seed, motion.rate_hz or None)


@lru_cache(maxsize=2)
def _opened(kind: str, folder: Path | None, seed: int, rate_hz: float | None) -> MotionSource:
    """One for all the clips of a run: they share examples."""
    return open_source(kind, folder, seed=seed, rate_hz=rate_hz)


def check_names(scenario: Scenario, source: MotionSource, parts: list[Part]) -> None:
    """Everything that a scenario names exists: clips, methods, inputs, bones, components. UnknownName, BadInput."""
    withheld = {Part.parse(text).clip for text in scenario.motion.withheld}
    for name in {part.clip for part in parts} | set(scenario.motion.examples) | withheld:
        source.check(name)
    for name in scenario.methods:
        registry.resolve(name)
    for name in scenario.inputs:
        combination(name, tuple(scenario.wearing))
    WireFormat(tuple(scenario.wearing), scenario.tracker.rate_hz, scenario.tracker.items)
    for mount in mounts_of(scenario):
        place(standard_skeleton(), mount)
    scenario.disturbance.added(noise_of(scenario), tuple(scenario.wearing))


def _in_order(todo: list[Job]) -> list[str]:
    """Every cell as tables list them: the varied values change slowest, then the clips."""
    cells = [cell for job in todo for cell in job.cells()]
    places = {varied_text(varied): place for place, (varied, _) in enumerate(variants(todo[0].scenario))}
    return [str(cell) for cell in sorted(cells, key=lambda cell: places[varied_text(cell.varied)])]


def _cells(todo: list[Job], out: Path, jobs: int) -> Iterator[Ended]:
    if min(jobs, len(todo)) <= 1:
        for job in todo:
            yield from run_job(job, out)
        return
    for which, done in call_each(_run_whole_job, [(job, out) for job in todo], min(jobs, len(todo))):
        try:
            yield from done.result()
        except BrokenExecutor:
            yield from (Ended(str(cell), failure="a worker process died") for cell in todo[which].cells())


def _run_whole_job(job: Job, out: Path) -> list[Ended]:
    return list(run_job(job, out))


def run_job(job: Job, out: Path) -> Iterator[Ended]:
    """Every cell of one clip, in order; a failure is reported in its place."""
    setting: Setting | None = None
    for cell in job.cells():
        try:
            if setting is None or setting.scenario != cell.scenario:
                setting = (setting and setting.under(cell.scenario)) or _setting(job, cell.scenario)
            method = registry.resolve(cell.method)
            key = setting.key(method, cell.method, cell.inputs, cell.varied)
            if not results.has_cell(out, key):
                results.write_cell(out, judge(setting, method, cell, key, job.command))
            yield Ended(str(cell), key)
        except HarnessError as error:
            yield Ended(str(cell), failure=str(error), refused=True)
        except (Exception, SystemExit) as error:  # a method may raise anything: its cell fails, the run goes on
            if was_interrupted(error):
                raise KeyboardInterrupt from error
            yield Ended(str(cell), failure=traceback.format_exc())


def _setting(job: Job, scenario: Scenario) -> Setting:
    return Setting(scenario, source_of(scenario.motion, job.folder, scenario.seed), job.part, job.behaviour)


def judge(setting: Setting, method: Method, planned: Planned, key: str, command: str) -> results.Cell:
    """Fit, run causally over the stream, score."""
    scenario, simulation = setting.scenario, setting.simulation
    seen = combination(planned.inputs, simulation.stations)
    known, fitted = setting.calibrated, setting.fitted(method, planned.method)
    qpos, status, step_ms = reconstruct(fitted, known.calibration, simulation, seen)
    scores = score(
        setting.body.skeleton,
        scenario.tracker.rate_hz,
        simulation.truth_qpos,
        qpos,
        simulation.frame_index,
        status,
        step_ms,
        estimate_skeleton=known.body.skeleton,
    )
    frames = simulation.frames
    return results.Cell(
        key=key,
        method=planned.method,
        behaviour=setting.behaviour,
        clip=str(setting.part),
        motion_source=setting.source.title,
        stations=simulation.stations,
        mount=scenario.mount,
        rate_hz=scenario.tracker.rate_hz,
        inputs=planned.inputs,
        protocol=scenario.motion.protocol if method.needs_examples else "none",
        calibration=known.calibration.kind,
        noise=scenario.profile or scenario.noise + ("*" if scenario.components else ""),
        seed=scenario.seed,
        performer=setting.performer,
        varied=planned.varied,
        defined_by=setting.inputs_of(method, planned.inputs),
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
        quality=np.array([f.quality for f in frames]),
        position_valid=np.array([f.position_valid for f in frames]),
        orientation_valid=np.array([f.orientation_valid for f in frames]),
        suspect=np.array([f.suspect for f in frames]),
    )


def reconstruct(
    reconstructor: Reconstructor, calibration: Calibration, simulation: Simulation, inputs: Inputs
) -> tuple[Floats, Ints, Floats]:
    """Estimates (F, 55), status (F,) and wall time of each step [ms] (F,); the truth stays on this side."""
    session = reconstructor.begin(calibration)
    qpos, status, step_ms = [], [], []
    for frame in simulation.frames:
        shown = inputs.masked(frame)
        start = time.perf_counter()
        estimate = session.step(shown)
        step_ms.append(1e3 * (time.perf_counter() - start))
        qpos.append(estimate.qpos)
        status.append(estimate.status)
    return np.array(qpos), np.array(status), np.array(step_ms)
