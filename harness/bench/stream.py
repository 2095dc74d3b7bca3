"""How fast a take becomes tracker frames: replay, statistical noise, the device's bytes and their decoder.

Six trackers at level `default` on a take of the built-in performer, at the tracker's default rate. The frames are
those that a method is given, so making them is part of what is timed; motion and body are made beforehand. The
same at level `clean` shows what the noise costs; MuJoCo's bare kinematics of as many poses is the reference. The
contenders take turns, so that whatever else the machine does meets all alike.
"""

import time
from collections.abc import Callable

import numpy as np

from harness.bench.rows import Row
from harness.body import mounts, retarget
from harness.body.kinematics import Kinematics
from harness.core.arrays import Floats
from harness.mocap import performer
from harness.simulate import noise
from harness.simulate.simulate import TrackerConfig, simulate
from harness.simulate.trajectory import Trajectory

STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")


def bench_stream(seed: int = 1, repeats: int = 7) -> list[Row]:
    """Medians over `repeats` runs of one take of 20 s."""
    clip = performer.generate("boxing", performer.performers()[0], 1, seed=seed)
    body, take = retarget.to_own_body(clip)
    worn, tracker = [mounts.DEFAULTS[station] for station in STATIONS], TrackerConfig()

    def replayed(level: str) -> int:
        return len(simulate(body, take, worn, tracker, noise.level(level), seed=seed).frames)

    frames = replayed("default")
    moments_s = np.arange(frames) / tracker.rate_hz
    poses = Trajectory(body, take).qpos(moments_s[moments_s < Trajectory(body, take).duration_s])
    contenders: tuple[Callable[[], object], ...] = (
        lambda: replayed("default"),
        lambda: replayed("clean"),
        lambda: Trajectory(body, take),
        lambda: _pose(Kinematics(body), poses),
    )
    seconds = np.array([[_seconds(contender) for contender in contenders] for _ in range(repeats)])
    whole_s, clean_s, spline_s, bare_s = np.median(seconds, axis=0).tolist()
    pose_s = bare_s / len(poses)
    beside = f"level clean {frames / clean_s:.0f} frames/s; the spline takes {spline_s / whole_s:.0%} of the time"
    return [
        Row("replay + noise + codec, six trackers", frames / whole_s, "frames/s", beside, ">= 5000"),
        Row("a frame / bare kinematics", whole_s / frames / pose_s, "x", f"{1.0 / pose_s:.0f} poses/s", ""),
    ]


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _pose(kinematics: Kinematics, poses: Floats) -> None:
    for qpos in poses:
        kinematics.set(qpos)
