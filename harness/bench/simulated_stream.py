"""How fast a take becomes tracker frames: replay, statistical noise, the device's bytes and their decoder.

Six trackers at level `default` on a take of the built-in performer, at the tracker's default rate. The frames are
those that a method is given, so making them is part of what is timed; motion and body are made beforehand. Beside
it, parts of the way alone, and MuJoCo's bare kinematics of as many poses. The contenders take turns, so that
whatever else the machine does meets all alike.
"""

import time
from collections.abc import Callable

import numpy as np

from harness.bench.rows import BenchmarkRow
from harness.body import mounts, retargeting
from harness.body.kinematics import Kinematics
from harness.core.arrays import Floats
from harness.mocap import synthetic
from harness.simulate import noise
from harness.simulate.simulation import Simulation, TrackerConfig, simulate_tracker
from harness.stream.codec.decoder import Decoder
from harness.stream.codec.reader import CaptureStream

STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")


def bench_stream(seed: int = 1, repeats: int = 7) -> list[BenchmarkRow]:
    """Medians over `repeats` turns; each turn is one take of 20 s for each contender."""
    clip = synthetic.generate("boxing", synthetic.performer_names()[0], 1, seed=seed)
    body, take = retargeting.retarget_to_own_body(clip)
    worn = [mounts.DEFAULT_MOUNTS[station] for station in STATIONS]

    def replayed(level: str) -> Simulation:
        return simulate_tracker(body, take, worn, TrackerConfig(), noise.noise_preset(level), seed=seed)

    seen = replayed("default")
    contenders: tuple[Callable[[], object], ...] = (
        lambda: replayed("default"),
        lambda: replayed("clean"),
        lambda: list(CaptureStream(seen.wire_format, seen.wire)),
        lambda: _decode_capture(seen),
        lambda: _pose_all(Kinematics(body), seen.truth_qpos),
    )
    seconds = np.array([[_time_call(contender) for contender in contenders] for _ in range(repeats)])
    whole_s, clean_s, frames_s, records_s, poses_s = np.median(seconds, axis=0).tolist()
    frames = len(seen.frames)
    return [
        BenchmarkRow(
            "replay + noise + codec, six trackers",
            frames / whole_s,
            "frames/s",
            f"without noise {frames / clean_s:.0f} frames/s",
            ">= 5000",
        ),
        BenchmarkRow(
            "bytes into frames", frames / frames_s, "frames/s", f"{frames_s / whole_s:.0%} of the whole way", ""
        ),
        BenchmarkRow("bytes into records", frames * len(STATIONS) / records_s, "records/s", "the same bytes", ""),
        BenchmarkRow(
            "a frame / bare kinematics of a pose", whole_s / poses_s, "x", f"{frames / poses_s:.0f} poses/s", ""
        ),
    ]


def _time_call(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _decode_capture(seen: Simulation) -> None:
    Decoder(dict.fromkeys(seen.wire_format.characters, seen.wire_format.items)).feed(seen.wire.data)


def _pose_all(kinematics: Kinematics, poses: Floats) -> None:
    for qpos in poses:
        kinematics.set(qpos)
