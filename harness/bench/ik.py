"""How fast inverse kinematics converges, beside mink on the same targets and with the same rule for stopping.

Six trackers on the built-in performer's walk at 40 Hz, with a tracker's white noise. In every frame both start from
the true pose of the frame before, keep the same limits, and step on until a step lowers the cost (half the squared
residuals over their variances) by less than 1e-4, the cost itself is below that, no component of a step exceeds 1e-4
(m, rad), or 30 steps are spent. What decides about mink is computed off its clock. They take turns, a second of
motion each, so that whatever else the machine does meets all alike; ratios are medians over turns.
"""

import copy
import time
from collections.abc import Callable
from dataclasses import dataclass

import mink
import numpy as np

from harness.bench.rows import BenchmarkRow
from harness.body import humanoid, mounts
from harness.body.kinematics import Kinematics
from harness.body.retargeting import retarget_to_own_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.humanoid24 import pack
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.mocap import synthetic
from harness.reconstruct.methods.ik import Ik
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream.frame import TrackerFrame

STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")
RATE_HZ, FRAMES_PER_TURN = 40.0, 40
NOISE_M, NOISE_RAD = 0.75e-3, float(np.deg2rad(0.05))
"""White noise per record of the default levels."""
STOPPING = Stopping(step=1e-4, decrease=1e-4, most_steps=30)
LEAST_SQUARES = Loss(robust=False)
MINK_DAMPING = 3.0
"""Where mink leaves the least residual on these targets: with less it never settles on noise, with more it crawls."""

TimedSolver = Callable[[TrackerFrame, Floats], tuple[Floats, float]]
"""Takes a frame and a pose to start from to a configuration (55,) and the seconds that it took."""


@dataclass(frozen=True, eq=False)
class IKBenchmarkCase:
    """What all contenders are given. The tracker's frame is the world's."""

    body: humanoid.Body
    """With the stations as sites."""
    calibration: Calibration
    frames: list[TrackerFrame]
    starts: Floats
    """(T, 55) for each frame the true pose of the one before."""
    examples: tuple[BodyMotion, ...]
    """Another walk of the same performer."""


def bench_ik(seed: int = 1, frames: int = 400) -> list[BenchmarkRow]:
    """Throughput of `ik` as it is used; then of its solver beside mink's, prior and robust loss off."""
    setting = make_case(seed, frames)
    contenders = {"used": registered_ik(setting), "bare": plain_solver(setting), "mink": mink_solver(setting)}
    seconds = {name: np.zeros(frames) for name in contenders}
    poses = {name: np.zeros((frames, setting.starts.shape[1])) for name in contenders}
    for turn in range(0, frames, FRAMES_PER_TURN):
        for name, follow in contenders.items():
            for frame in range(turn, min(turn + FRAMES_PER_TURN, frames)):
                poses[name][frame], seconds[name][frame] = follow(setting.frames[frame], setting.starts[frame])
    per_turn = {name: np.add.reduceat(spent, np.arange(0, frames, FRAMES_PER_TURN)) for name, spent in seconds.items()}
    fps = {name: FRAMES_PER_TURN / float(np.median(spent)) for name, spent in per_turn.items()}
    ratio = float(np.median(per_turn["mink"] / per_turn["bare"]))
    ours, theirs = (residual_errors(setting, poses[name]) for name in ("bare", "mink"))
    return [
        BenchmarkRow("ik, six trackers, converged", fps["used"], "frames/s", "", ">= 1500"),
        BenchmarkRow(
            "ik without prior and robust loss", fps["bare"], "frames/s", f"mink {fps['mink']:.0f} frames/s", ""
        ),
        BenchmarkRow("ik / mink", ratio, "x", "the same targets", ">= 3"),
        BenchmarkRow("tracker residual, cost", ours[0], "", f"mink {theirs[0]:.4f}", "<= mink"),
        BenchmarkRow("tracker residual, position", ours[1], "mm RMS", f"mink {theirs[1]:.4f} mm", "<= mink"),
        BenchmarkRow("tracker residual, orientation", ours[2], "deg RMS", f"mink {theirs[2]:.4f} deg", "<= mink"),
    ]


def make_case(seed: int, frames: int) -> IKBenchmarkCase:
    """A walk, and readings of it in the frame of the world."""
    who = synthetic.performer_names()[0]
    clip = synthetic.generate("walking", who, 1, seed=seed, rate_hz=RATE_HZ, duration_s=frames / RATE_HZ)
    worn = tuple(mounts.DEFAULT_MOUNTS[station] for station in STATIONS)
    body = humanoid.build_body(clip.skeleton, worn)
    on_bones = [mounts.locate_mount(body.skeleton, mount) for mount in worn]
    calibration = Calibration(
        "exact",
        STATIONS,
        tuple(mount.bone for mount in worn),
        np.array([mount_m for mount_m, _ in on_bones]),
        np.array([bone_from_station for _, bone_from_station in on_bones]),
        rotations.IDENTITY,
        np.zeros(3),
    )
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)[:frames]
    qpos[:, 7:] = HingeLimits(body).principal(qpos[:, 7:])
    rng, kinematics = generator(seed, "bench", "ik"), Kinematics(body)
    readings = [_noisy_frame(kinematics, calibration, q, t / RATE_HZ, rng) for t, q in enumerate(qpos)]
    other = synthetic.generate("walking", who, 2, seed=seed, rate_hz=RATE_HZ, duration_s=frames / RATE_HZ)
    example = retarget_to_own_body(other)[1]
    return IKBenchmarkCase(body, calibration, readings, np.concatenate([qpos[:1], qpos[:-1]]), (example,))


def _noisy_frame(
    kinematics: Kinematics, worn: Calibration, qpos: Floats, time_s: float, rng: np.random.Generator
) -> TrackerFrame:
    kinematics.set(qpos)
    bones = [kinematics.body.skeleton.index(bone) for bone in worn.bones]
    at_m, turned = kinematics.station_poses(bones, worn.mount_m, worn.bone_from_station)
    every = np.ones(len(bones), bool)
    return TrackerFrame(
        received_s=time_s,
        measured_s=np.full(len(bones), time_s),
        position_m=at_m + rng.normal(0.0, NOISE_M, at_m.shape),
        tracker_from_station=rotations.multiply(turned, rotations.exp(rng.normal(0.0, NOISE_RAD, at_m.shape))),
        position_valid=every,
        orientation_valid=every,
        quality=np.ones(len(bones)),
        suspect=~every,
    )


def registered_ik(setting: IKBenchmarkCase) -> TimedSolver:
    """The registered method: cold start, then always from its own last pose."""
    session = Ik().fit(setting.body, setting.examples, np.random.default_rng(0)).begin(setting.calibration)

    def follow(frame: TrackerFrame, start: Floats) -> tuple[Floats, float]:
        begin = time.perf_counter()
        estimate: Estimate = session.step(frame)
        return estimate.qpos, time.perf_counter() - begin

    return follow


def plain_solver(setting: IKBenchmarkCase) -> TimedSolver:
    """Its solver alone."""
    residuals = Residuals(setting.body, setting.calibration, LEAST_SQUARES)
    solver = IKSolver(residuals, HingeLimits(setting.body), STOPPING)

    def follow(frame: TrackerFrame, start: Floats) -> tuple[Floats, float]:
        begin = time.perf_counter()
        residuals.read(frame)
        qpos = solver.solve(start, Prior(start, None)).qpos
        return qpos, time.perf_counter() - begin

    return follow


def mink_solver(setting: IKBenchmarkCase) -> TimedSolver:
    """mink's differential inverse kinematics with daqp, one full step after another."""
    model, limits = copy.copy(setting.body.model), HingeLimits(setting.body)
    model.jnt_limited[1:] = np.isfinite(limits.high_rad)
    configuration = mink.Configuration(model)
    weights = {
        "position_cost": 1.0 / LEAST_SQUARES.position_sigma_m,
        "orientation_cost": 1.0 / LEAST_SQUARES.orientation_sigma_rad,
    }
    tasks = [mink.FrameTask(station, "site", **weights) for station in setting.calibration.stations]
    kept = [mink.ConfigurationLimit(model, gain=1.0)]
    judge = Residuals(setting.body, setting.calibration, LEAST_SQUARES)

    def follow(frame: TrackerFrame, start: Floats) -> tuple[Floats, float]:
        configuration.update(start)
        judge.read(frame)
        cost = judge.evaluate(start)
        begin = time.perf_counter()
        for task, at_m, turned in zip(tasks, frame.position_m, frame.tracker_from_station, strict=True):
            task.set_target(mink.SE3(np.concatenate([turned, at_m])))
        seconds = time.perf_counter() - begin
        for _ in range(STOPPING.most_steps):
            begin = time.perf_counter()
            # limits by keyword: a positional fifth argument would land in safety_break and switch them off
            velocity = mink.solve_ik(configuration, tasks, 1.0, "daqp", damping=MINK_DAMPING, limits=kept)
            configuration.integrate_inplace(velocity, 1.0)
            seconds += time.perf_counter() - begin
            before, cost = cost, judge.evaluate(configuration.q)
            if abs(velocity).max() < STOPPING.step or min(cost, abs(before - cost)) < STOPPING.decrease:
                break
        return configuration.q.copy(), seconds

    return follow


def residual_errors(setting: IKBenchmarkCase, poses: Floats) -> tuple[float, float, float]:
    """Mean cost; RMS distances over frames and trackers [mm], [deg]."""
    judge, costs, distances = Residuals(setting.body, setting.calibration, LEAST_SQUARES), [], []
    for frame, qpos in zip(setting.frames, poses, strict=True):
        judge.read(frame)
        costs.append(judge.evaluate(qpos))
        distances.append(judge.distance)
    position, orientation = np.split(np.sqrt(np.mean(np.square(distances), axis=0)), 2)
    rms_m, rms_rad = (float(np.sqrt(np.mean(part**2))) for part in (position, orientation))
    return float(np.mean(costs)), 1e3 * rms_m, float(np.rad2deg(rms_rad))
