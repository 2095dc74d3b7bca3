"""Speed of inverse kinematics, beside mink on the same targets and with the same stopping rule.

Six stations on synthetic walking at 40 Hz, with a tracker's white noise. In every frame both solvers start from the
true pose of the frame before and keep the same joint limits. They iterate until one of these holds:

- a step lowers the cost (half the squared residuals over their variances) by less than 1e-4;
- the cost is below 1e-4;
- no component of a step exceeds 1e-4 (m, rad);
- 30 steps are done.

The stopping rule of mink is evaluated outside its timed part. The solvers take turns (`round_robin_timing`); ratios are
medians over turns.
"""

import copy
import time
from dataclasses import dataclass

import numpy as np

from harness.bench.common import MOUNTS, world_calibration
from harness.bench.limits import hold_to_limit
from harness.body import Body, Kinematics, build_body, retarget_to_own_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.humanoid24 import pack
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.core.working_folder import plain_import
from harness.mocap import synthetic
from harness.reconstruct import Ik
from harness.reconstruct.solver import HingeLimits, IKSolver, Loss, Prior, Residuals, Stopping
from harness.results.findings import BenchmarkStatement
from harness.stream import TrackerFrame
from harness.study.speed.round_robin_timing import MethodTimings, TimedStep, take_turns

with plain_import():
    import mink

RATE_HZ = 40.0
NOISE_M, NOISE_RAD = 0.75e-3, float(np.deg2rad(0.05))
"""Standard deviation of white noise per record, as in noise preset `default`."""
STOPPING = Stopping(step=1e-4, decrease=1e-4, most_steps=30)
LEAST_SQUARES = Loss(robust=False)
MIN_USED_RATIO, MIN_RATIO = 8.0, 3.0
"""Least speed relative to mink: of `ik` as registered, and of its solver on mink's task."""
MINK_DAMPING = 3.0
"""The damping at which mink leaves the smallest residual here: less does not settle on noise, more is slow."""


@dataclass(frozen=True, eq=False)
class IKBenchmarkCase:
    """Input of all solvers; the tracker frame is the world frame."""

    body: Body
    """The body with the stations as sites."""
    calibration: Calibration
    frames: list[TrackerFrame]
    truth: Floats
    """(T, 55) the true pose at each frame."""
    examples: tuple[BodyMotion, ...]
    """Another walk of the same performer."""


def bench_ik(seed: int = 1, frames: int = 400) -> list[BenchmarkStatement]:
    """Throughput of `ik` as registered; then of its solver beside mink, without prior and robust loss."""
    case = make_case(seed, frames)
    steps = {
        "used": registered_ik(case),
        "bare": plain_solver(case.body, case.calibration),
        "mink": mink_solver(case.body, case.calibration),
    }
    timings, turns = {name: MethodTimings() for name in steps}, dict[str, list[Floats]]({name: [] for name in steps})
    for turn in take_turns(steps, case.frames, case.truth):
        timings[turn.method].add(turn)
        turns[turn.method].append(turn.qpos)
    used, ratio = (timings[name].speed_ratio(timings["mink"]) for name in ("used", "bare"))
    ours, theirs = (residual_errors(case, np.concatenate(turns[name])) for name in ("bare", "mink"))
    reference = f"mink {timings['mink'].fps:.0f} frames/s"
    return [
        hold_to_limit("ik, six trackers, converged", timings["used"].fps, "frames/s"),
        hold_to_limit("ik without prior and robust loss", timings["bare"].fps, "frames/s", reference=reference),
        hold_to_limit("speed of ik / mink", used, "x", least=MIN_USED_RATIO, reference=f"{reference}, the same frames"),
        hold_to_limit("speed without prior and robust loss / mink", ratio, "x", least=MIN_RATIO, reference=reference),
        *(
            hold_to_limit(f"tracker residual, {name} / mink", a / b, "x", most=1.0, reference=f"{a:.4f} and {b:.4f}")
            for name, a, b in zip(("cost", "position [mm]", "orientation [deg]"), ours, theirs, strict=True)
        ),
    ]


def make_case(seed: int, frames: int) -> IKBenchmarkCase:
    """Make a synthetic walk and noisy readings of it in the world frame."""
    performer = synthetic.performer_names()[0]
    clip = synthetic.generate("walking", performer, 1, seed=seed, rate_hz=RATE_HZ, duration_s=frames / RATE_HZ)
    body = build_body(clip.skeleton, MOUNTS)
    calibration = world_calibration(body)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)[:frames]
    qpos[:, 7:] = HingeLimits(body).principal(qpos[:, 7:])
    rng, kinematics = generator(seed, "bench", "ik"), Kinematics(body)
    readings = [_noisy_frame(kinematics, calibration, q, t / RATE_HZ, rng) for t, q in enumerate(qpos)]
    other = synthetic.generate("walking", performer, 2, seed=seed, rate_hz=RATE_HZ, duration_s=frames / RATE_HZ)
    example = retarget_to_own_body(other)[1]
    return IKBenchmarkCase(body, calibration, readings, qpos, (example,))


def _noisy_frame(
    kinematics: Kinematics, calibration: Calibration, qpos: Floats, time_s: float, rng: np.random.Generator
) -> TrackerFrame:
    kinematics.set(qpos)
    bones = [kinematics.body.skeleton.index(bone) for bone in calibration.bones]
    position_m, orientation = kinematics.station_poses(bones, calibration.mount_m, calibration.bone_from_station)
    read_m = position_m + rng.normal(0.0, NOISE_M, position_m.shape)
    turned = rotations.multiply(orientation, rotations.exp(rng.normal(0.0, NOISE_RAD, position_m.shape)))
    valid = np.ones(len(bones), bool)
    return TrackerFrame(time_s, np.full(len(bones), time_s), read_m, turned, valid, valid, np.ones(len(bones)), ~valid)


def registered_ik(case: IKBenchmarkCase) -> TimedStep:
    """The registered method: it starts cold and continues from its own last pose."""
    session = Ik().fit(case.body, case.examples, np.random.default_rng(0)).begin(case.calibration)

    def timed_step(frame: TrackerFrame, start: Floats) -> tuple[Floats, float]:
        begin = time.perf_counter()
        qpos = session.step(frame).qpos
        return qpos, time.perf_counter() - begin

    return timed_step


def plain_solver(body: Body, calibration: Calibration) -> TimedStep:
    """The solver of `ik` without prior and robust loss."""
    residuals = Residuals(body, calibration, LEAST_SQUARES)
    solver = IKSolver(residuals, HingeLimits(body), STOPPING)

    def timed_step(frame: TrackerFrame, start: Floats) -> tuple[Floats, float]:
        begin = time.perf_counter()
        residuals.read(frame)
        qpos = solver.solve(start, Prior(start, None)).qpos
        return qpos, time.perf_counter() - begin

    return timed_step


def mink_solver(body: Body, calibration: Calibration) -> TimedStep:
    """mink's differential inverse kinematics with daqp, in full steps."""
    model, limits = copy.copy(body.model), HingeLimits(body)
    model.jnt_limited[1:] = np.isfinite(limits.high_rad)
    configuration = mink.Configuration(model)
    weights = {
        "position_cost": 1.0 / LEAST_SQUARES.position_sigma_m,
        "orientation_cost": 1.0 / LEAST_SQUARES.orientation_sigma_rad,
    }
    tasks = [mink.FrameTask(station, "site", **weights) for station in calibration.stations]
    joint_limits = [mink.ConfigurationLimit(model, gain=1.0)]
    residuals = Residuals(body, calibration, LEAST_SQUARES)

    def timed_step(frame: TrackerFrame, start: Floats) -> tuple[Floats, float]:
        configuration.update(start)
        residuals.read(frame)
        cost = residuals.evaluate(start)
        begin = time.perf_counter()
        for task, position_m, orientation in zip(tasks, frame.position_m, frame.tracker_from_station, strict=True):
            task.set_target(mink.SE3(np.concatenate([orientation, position_m])))
        seconds = time.perf_counter() - begin
        for _ in range(STOPPING.most_steps):
            begin = time.perf_counter()
            # limits by keyword: a positional fifth argument would land in safety_break and switch them off
            velocity = mink.solve_ik(configuration, tasks, 1.0, "daqp", damping=MINK_DAMPING, limits=joint_limits)
            configuration.integrate_inplace(velocity, 1.0)
            seconds += time.perf_counter() - begin
            before, cost = cost, residuals.evaluate(configuration.q)
            if abs(velocity).max() < STOPPING.step or min(cost, abs(before - cost)) < STOPPING.decrease:
                break
        return configuration.q.copy(), seconds

    return timed_step


def residual_errors(case: IKBenchmarkCase, poses: Floats) -> tuple[float, float, float]:
    """Mean cost; RMS distances over frames and stations [mm], [deg]."""
    residuals, costs, distances = Residuals(case.body, case.calibration, LEAST_SQUARES), [], []
    for frame, qpos in zip(case.frames[: len(poses)], poses, strict=True):
        residuals.read(frame)
        costs.append(residuals.evaluate(qpos))
        distances.append(residuals.distance)
    position, orientation = np.split(np.sqrt(np.mean(np.square(distances), axis=0)), 2)
    rms_m, rms_rad = (float(np.sqrt(np.mean(part**2))) for part in (position, orientation))
    return float(np.mean(costs)), 1e3 * rms_m, float(np.rad2deg(rms_rad))
