"""The whole loop: mocap -> body -> simulate -> calibrate -> reconstruct -> score -> report, cell by cell.

A job is one test clip: simulated once, then shown to every method with every choice of inputs. Each pair is a cell,
written whole or not at all, so that a run can be stopped at any moment and goes on where it was.
"""

import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from harness.body.mounts import place
from harness.config import Motion, Scenario
from harness.core.arrays import Floats, Ints
from harness.core.humanoid24 import standard_skeleton
from harness.core.protocol import Part
from harness.core.seeds import generator
from harness.core.workers import call_each
from harness.errors import BadInput, HarnessError, Outcome, was_interrupted
from harness.mocap.sources import MotionSource, open_source
from harness.reconstruct import registry
from harness.reconstruct.contract import Method, Reconstructor
from harness.score import manifest, results
from harness.score.score import score
from harness.setting import Setting, mounts_of, noise_of
from harness.simulate.simulate import Simulation
from harness.stream.inputs import Inputs, combination
from harness.stream.reader import WireFormat

Progress = Callable[[str, int, int], None]
"""Called with what was done last, how many cells are finished and how many were planned."""


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

    def cells(self) -> list[tuple[str, str, str]]:
        """What each cell is called, its method and its inputs."""
        return [
            (f"{method} on {self.part}" + ("" if inputs == "pos+ori" else f" ({inputs})"), method, inputs)
            for inputs in self.scenario.inputs
            for method in self.scenario.methods
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
    parts = [Part.parse(text) for text in scenario.motion.test]
    behaviours = scenario.motion.behaviours * (1 if len(scenario.motion.behaviours) > 1 else len(parts))
    todo = [Job(scenario, part, b, folder, command) for part, b in zip(parts, behaviours, strict=True)]
    source = source_of(scenario.motion, folder, scenario.seed)
    check_names(scenario, source, parts)
    results.open_run(out, manifest.of_run(asdict(scenario), motion_source=source.title, command=command))
    planned = [cell for job in todo for cell, _, _ in job.cells()]
    ended: dict[str, Ended] = {}
    try:
        for cell in _cells(todo, out, jobs):
            ended[cell.cell] = cell
            progress(cell.cell, len(ended), len(planned))
    finally:
        in_order = [ended[cell] for cell in planned if cell in ended]
        failed = {cell.cell: cell.failure for cell in in_order if cell.failure}
        keys = [cell.key for cell in in_order if not cell.failure]
        summary = results.write_summary(out, keys=keys, planned=len(planned), failures=failed)
    if failed and all(cell.refused for cell in in_order):
        raise BadInput(f"Nothing could be run. {next(iter(failed.values()))}", "")
    if failed:
        return Outcome.INCOMPLETE
    measured = any(row["joint_angle_mean_deg"] is not None for row in summary["cells"])
    return Outcome.PASS if measured else Outcome.NOT_COMPARABLE


def source_of(motion: Motion, folder: Path | None, seed: int) -> MotionSource:
    """The motion that a scenario names; BadInput when it needs a library and none is named."""
    return open_source(motion.source, folder, seed=seed, rate_hz=motion.rate_hz or None)


def check_names(scenario: Scenario, source: MotionSource, parts: list[Part]) -> None:
    """Everything that a scenario names exists: clips, methods, inputs, bones, components. UnknownName, BadInput."""
    withheld = {Part.parse(text).clip for text in scenario.motion.withheld}
    for name in {part.clip for part in parts} | set(scenario.motion.examples) | withheld:
        source.check(name)
    for name in scenario.methods:
        registry.resolve(name)
    for name in scenario.inputs:
        combination(name, tuple(scenario.stations))
    WireFormat(tuple(scenario.stations), scenario.tracker.rate_hz, scenario.tracker.items)
    for mount in mounts_of(scenario):
        place(standard_skeleton(), mount)
    noise_of(scenario)


def _cells(todo: list[Job], out: Path, jobs: int) -> Iterator[Ended]:
    if min(jobs, len(todo)) <= 1:
        for job in todo:
            yield from run_job(job, out)
        return
    for which, done in call_each(_run_whole_job, [(job, out) for job in todo], min(jobs, len(todo))):
        try:
            yield from done.result()
        except BrokenExecutor:
            yield from (Ended(cell, failure="a worker process died") for cell, _, _ in todo[which].cells())


def _run_whole_job(job: Job, out: Path) -> list[Ended]:
    return list(run_job(job, out))


def run_job(job: Job, out: Path) -> Iterator[Ended]:
    """Every cell of one clip, in order; a failure is reported in its place."""
    setting: Setting | None = None
    for cell, name, inputs in job.cells():
        try:
            if setting is None:
                source = source_of(job.scenario.motion, job.folder, job.scenario.seed)
                setting = Setting(job.scenario, source, job.part, job.behaviour)
            method = registry.resolve(name)
            key = setting.key(method, name, inputs)
            if not results.has_cell(out, key):
                results.write_cell(out, judge(setting, method, name, inputs, key, job.command))
            yield Ended(cell, key)
        except HarnessError as error:
            yield Ended(cell, failure=str(error), refused=True)
        except (Exception, SystemExit) as error:  # a method may raise anything: its cell fails, the run goes on
            if was_interrupted(error):
                raise KeyboardInterrupt from error
            yield Ended(cell, failure=traceback.format_exc())


def judge(setting: Setting, method: Method, name: str, inputs: str, key: str, command: str) -> results.Cell:
    """Fit, run causally over the stream, score."""
    scenario, simulation = setting.scenario, setting.simulation
    seen = combination(inputs, simulation.stations)
    examples = setting.examples if method.needs_examples else []
    reconstructor = method.fit(
        setting.body, examples, generator(scenario.seed, "method", registry.without_options(name))
    )
    qpos, status, step_ms = reconstruct(reconstructor, simulation, seen)
    scores = score(
        setting.body.skeleton,
        scenario.tracker.rate_hz,
        simulation.truth_qpos,
        qpos,
        simulation.frame_index,
        status,
        step_ms,
    )
    frames = simulation.frames
    return results.Cell(
        key=key,
        method=name,
        behaviour=setting.behaviour,
        clip=str(setting.part),
        motion_source=setting.source.title,
        stations=simulation.stations,
        mount=scenario.mount,
        rate_hz=scenario.tracker.rate_hz,
        inputs=inputs,
        protocol=scenario.motion.protocol if method.needs_examples else "none",
        calibration=simulation.calibration.kind,
        noise=scenario.profile or scenario.noise + ("*" if scenario.components else ""),
        seed=scenario.seed,
        defined_by=setting.inputs_of(method, inputs),
        scores=scores,
        health=simulation.health,
        bone_m=setting.body.skeleton.bone_m,
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


def reconstruct(reconstructor: Reconstructor, simulation: Simulation, inputs: Inputs) -> tuple[Floats, Ints, Floats]:
    """Estimates (F, 55), status (F,) and wall time of each step [ms] (F,); the truth stays on this side."""
    session = reconstructor.begin(simulation.calibration)
    qpos, status, step_ms = [], [], []
    for frame in simulation.frames:
        shown = inputs.masked(frame)
        start = time.perf_counter()
        estimate = session.step(shown)
        step_ms.append(1e3 * (time.perf_counter() - start))
        qpos.append(estimate.qpos)
        status.append(estimate.status)
    return np.array(qpos), np.array(status), np.array(step_ms)
