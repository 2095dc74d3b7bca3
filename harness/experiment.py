"""The whole loop: mocap -> body -> simulate -> calibrate -> reconstruct -> score -> report, cell by cell.

A job is one test clip: simulated once, then shown to every method with every choice of inputs. Each pair is a cell,
written whole or not at all, so that a run can be stopped at any moment and goes on where it was.
"""

import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from harness.body import humanoid, retarget
from harness.body.mounts import Mount
from harness.config import Motion, Scenario, changed
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.motion import Clip, Take
from harness.core.protocol import Part, allowed_frames, examples_of, refuse_leak
from harness.core.seeds import generator
from harness.errors import HarnessError, Outcome
from harness.mocap.sources import MotionSource, open_source
from harness.reconstruct import registry
from harness.reconstruct.contract import Method, Reconstructor
from harness.score import manifest as manifests
from harness.score import results
from harness.score.score import score
from harness.simulate import noise as noises
from harness.simulate.simulate import Simulation, TrackerConfig, simulate
from harness.simulate.trajectory import Trajectory
from harness.stream.inputs import Inputs, combination

Progress = Callable[[str, int, int], None]
"""Called with what was done last, how many cells are finished and how many were planned."""


@dataclass(frozen=True)
class Finished:
    """What became of one cell."""

    cell: str
    """Method, clip and inputs, to print."""
    key: str
    failure: str = ""
    """The traceback, or the refusal, of a cell that failed."""


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
    listed with its traceback and never stops the rest. Names that do not exist are refused before anything runs.
    """
    source = source_of(scenario.motion, folder, scenario.seed)
    todo = [
        Job(scenario, Part.parse(text), behaviour, folder, command)
        for text, behaviour in zip(scenario.motion.test, _behaviours(scenario.motion), strict=True)
    ]
    for name in {job.part.clip for job in todo} | set(scenario.motion.examples):
        source.check(name)
    for name in scenario.methods:
        registry.resolve(name)
    for name in scenario.inputs:
        combination(name, tuple(scenario.stations))
    results.open_run(out, manifests.of_run(asdict(scenario), motion_source=source.title, command=command))
    planned = len(todo) * len(scenario.methods) * len(scenario.inputs)
    finished: list[Finished] = []
    try:
        for cell in _cells(todo, out, jobs):
            finished.append(cell)
            progress(cell.cell, len(finished), planned)
    finally:
        keys = [cell.key for cell in finished if not cell.failure]
        failures = {cell.cell: cell.failure for cell in finished if cell.failure}
        results.write_summary(out, keys=keys, planned=planned, failures=failures)
    if not keys and failures and all("\n" not in text for text in failures.values()):
        raise HarnessError(next(iter(failures.values())))
    return Outcome.INCOMPLETE if failures else Outcome.PASS


def source_of(motion: Motion, folder: Path | None, seed: int) -> MotionSource:
    return open_source(motion.source, folder, seed=seed, rate_hz=motion.rate_hz or None)


def _behaviours(motion: Motion) -> Sequence[str]:
    return motion.behaviours if len(motion.behaviours) > 1 else motion.behaviours * len(motion.test)


def _cells(todo: list[Job], out: Path, jobs: int) -> Iterator[Finished]:
    if jobs <= 1 or len(todo) == 1:
        for job in todo:
            yield from run_job(job, out)
        return
    with ProcessPoolExecutor(min(jobs, len(todo)), mp_context=get_context("spawn")) as pool:
        try:
            for future in as_completed([pool.submit(_run_whole_job, job, out) for job in todo]):
                yield from future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _run_whole_job(job: Job, out: Path) -> list[Finished]:
    return list(run_job(job, out))


def run_job(job: Job, out: Path) -> Iterator[Finished]:
    """Every cell of one clip, in order; a failure is reported in its place."""
    setting: Setting | None = None
    for inputs in job.scenario.inputs:
        for name in job.scenario.methods:
            title = f"{name} on {job.part}" + ("" if inputs == "pos+ori" else f" ({inputs})")
            key = ""
            try:
                setting = setting or Setting(job)
                method = registry.resolve(name)
                key = setting.key(method, name, inputs)
                if not results.has_cell(out, key):
                    results.write_cell(out, judge(setting, method, name, inputs, key))
                yield Finished(title, key)
            except HarnessError as error:
                yield Finished(title, key, str(error))
            except Exception:  # a method under test may raise anything: the cell fails, the run goes on
                yield Finished(title, key, traceback.format_exc())


class Setting:
    """What one clip's cells share, made when first asked for: the body, the true motion, its simulation, examples."""

    def __init__(self, job: Job) -> None:
        self.job = job
        self.scenario = job.scenario
        self.source = source_of(job.scenario.motion, job.folder, job.scenario.seed)
        self.clip = self.source.load(job.part.clip)

    @cached_property
    def body(self) -> humanoid.Body:
        if self.scenario.motion.body == "standard":
            return humanoid.build(standard_skeleton())
        return humanoid.build(self.clip.skeleton.subset(BONES)[0])

    @cached_property
    def whole(self) -> Take:
        """The test clip on the body."""
        return self._on_body(self.clip)

    @cached_property
    def take(self) -> Take:
        """The part of it that is judged."""
        frames = self.job.part.frames(len(self.whole))
        longest_s = self.scenario.motion.longest_s
        stop = min(frames.stop, frames.start + round(longest_s * self.whole.rate_hz) + 1) if longest_s else frames.stop
        return _cut(self.whole, range(frames.start, stop), str(self.job.part))

    @cached_property
    def simulation(self) -> Simulation:
        tracker = changed(TrackerConfig(), asdict(self.scenario.tracker), "tracker")
        noise = changed(noises.level(self.scenario.noise), self.scenario.components, "components")
        return simulate(self.body, self.take, self.mounts, tracker, noise, seed=self.scenario.seed)

    @cached_property
    def mounts(self) -> tuple[Mount, ...]:
        return tuple(
            Mount(name, s.bone, s.along, float(np.deg2rad(s.around_deg)), s.stand_off_m)
            for name, s in self.scenario.stations.items()
        )

    @cached_property
    def example_clips(self) -> list[Clip]:
        motion, test = self.scenario.motion, self.job.part
        subjects = {name: self.source.subject(name) for name in {*motion.examples, test.clip}}
        names = examples_of(test, motion.examples, motion.protocol, subjects)
        if motion.database == "behaviour":
            names = [name for name in names if self.source.behaviour(name) == self.job.behaviour]
        return [self.source.load(name) for name in names]

    @cached_property
    def examples(self) -> list[Take]:
        """What the protocol lets a method learn from, on this body and at the tracker's rate."""
        learnt, takes = [], []
        for clip in self.example_clips:
            whole = self._on_body(clip)
            for frames in allowed_frames(self.job.part, clip.name, len(clip), clip.rate_hz):
                learnt.append((clip.name, frames))
                takes.append(_at_rate(self.body, _cut(whole, frames, clip.name), self.scenario.tracker.rate_hz))
        refuse_leak(self.job.part, learnt, len(self.clip), self.clip.rate_hz)
        return takes

    def inputs_of(self, method: Method, name: str, inputs: str) -> dict[str, object]:
        """Everything that defines a cell; two results with other inputs are not comparable."""
        content = asdict(self.scenario)
        for many in ("methods", "inputs", "name"):
            del content[many]
        del content["motion"]["test"], content["motion"]["behaviours"], content["motion"]["examples"]
        return {
            **content,
            "clip": str(self.job.part),
            "motion_digest": results.digest(self.clip.root_m, self.clip.world_from_root, self.clip.angles_rad),
            "body_digest": results.digest(self.clip.skeleton.bone_m),
            "examples": {
                c.name: results.digest(c.root_m, c.world_from_root, c.angles_rad)
                for c in (self.example_clips if method.needs_examples else [])
            },
            "inputs": inputs,
        }

    def key(self, method: Method, name: str, inputs: str) -> str:
        described = {"name": name, "options": repr(method), "source": registry.source_hash(method)}
        return results.cell_key(self.inputs_of(method, name, inputs), described, manifests.source_hash())

    def _on_body(self, clip: Clip) -> Take:
        if clip.name == self.clip.name and self.scenario.motion.body == "own":
            return retarget.to_own_body(clip)[1]
        return retarget.to_common_body(clip, self.body.skeleton)[0]


def judge(setting: Setting, method: Method, name: str, inputs: str, key: str) -> results.Cell:
    """Fit, run causally over the stream, score."""
    scenario, simulation = setting.scenario, setting.simulation
    seen = combination(inputs, simulation.stations)
    examples = setting.examples if method.needs_examples else []
    reconstructor = method.fit(setting.body, examples, generator(scenario.seed, "method", name))
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
        behaviour=setting.job.behaviour,
        clip=str(setting.job.part),
        motion_source=setting.source.title,
        stations=simulation.stations,
        mount=scenario.mount,
        rate_hz=scenario.tracker.rate_hz,
        inputs=inputs,
        protocol=scenario.motion.protocol if method.needs_examples else "none",
        calibration=simulation.calibration.kind,
        noise=scenario.noise + ("*" if scenario.components else ""),
        seed=scenario.seed,
        defined_by=setting.inputs_of(method, name, inputs),
        scores=scores,
        health=simulation.health,
        bone_m=setting.body.skeleton.bone_m,
        source_hash=manifests.source_hash(),
        reproduce=setting.job.command,
        notes=setting.clip.notes,
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
    reconstructor: Reconstructor, simulation: Simulation, inputs: Inputs
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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


def _cut(take: Take, frames: range, name: str) -> Take:
    return Take(name, take.subject, take.source, take.behaviour, take.rate_hz, take.qpos[frames.start : frames.stop])


def _at_rate(body: humanoid.Body, take: Take, rate_hz: float) -> Take:
    """The take at the tracker's rate, on the same smooth trajectory that the simulation samples."""
    trajectory = Trajectory(body, take)
    time_s = np.arange(0.0, trajectory.duration_s, 1.0 / rate_hz)
    return Take(take.name, take.subject, take.source, take.behaviour, rate_hz, trajectory.qpos(time_s))
