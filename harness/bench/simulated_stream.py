"""Throughput of the simulated stream: replay, statistical noise, encoding to device bytes, decoding to frames.

Six stations with noise preset `default` on a synthetic take, at the tracker's default rate. Motion and body are made
in advance; making the frames is timed. Parts of the path and MuJoCo's kinematics of as many poses are timed separately.
Times are CPU times of this one thread, and the parts take turns, so that load on the machine affects all equally. The
shortest time of each part counts, since other load only adds to it.
"""

from collections.abc import Callable

import numpy as np

from harness.bench.common import MOUNTS, STATIONS, pose_all
from harness.bench.cpu_time import time_cpu
from harness.bench.limits import hold_to_limit
from harness.body import retarget_to_own_body
from harness.mocap import synthetic
from harness.results.findings import BenchmarkStatement
from harness.simulate import Simulation, TrackerConfig, noise_preset, simulate_tracker
from harness.stream.polhemus.codec import Decoder, FrameReader

MAX_RATIO = 13.0
"""Most CPU time of a frame, relative to MuJoCo's kinematics of one pose: as strict as 20,000 frames/s was."""


def bench_stream(seed: int = 1, repeats: int = 7) -> list[BenchmarkStatement]:
    """Shortest times of `repeats` turns; each turn is one take of 20 s for each part."""
    clip = synthetic.generate("boxing", synthetic.performer_names()[0], 1, seed=seed)
    body, take = retarget_to_own_body(clip)

    def simulate(preset: str) -> Simulation:
        return simulate_tracker(body, take, MOUNTS, TrackerConfig(), noise_preset(preset), seed=seed)

    simulation = simulate("default")
    parts: tuple[Callable[[], object], ...] = (
        lambda: simulate("default"),
        lambda: simulate("clean"),
        lambda: FrameReader(simulation.wire_format).feed_all(simulation.wire),
        lambda: _decode_capture(simulation),
        lambda: pose_all(body, simulation.truth_qpos),
    )
    seconds = np.array([[time_cpu(part) for part in parts] for _ in range(repeats)])
    total_s, clean_s, frames_s, records_s, poses_s = np.min(seconds, axis=0).tolist()
    frames = len(simulation.frames)
    rows = [
        ("replay + noise + codec, six trackers", frames / total_s, f"without noise {frames / clean_s:.0f} frames/s"),
        ("bytes into frames", frames / frames_s, f"{frames_s / total_s:.0%} of the total time"),
    ]
    records, ratio = frames * len(STATIONS) / records_s, total_s / poses_s
    poses = f"{frames / poses_s:.0f} poses/s"
    return [
        *(hold_to_limit(name, rate, "frames/s", reference=reference) for name, rate, reference in rows),
        hold_to_limit("bytes into records", records, "records/s", reference="the same bytes"),
        hold_to_limit("a frame / bare kinematics of a pose", ratio, "x", most=MAX_RATIO, reference=poses),
    ]


def _decode_capture(simulation: Simulation) -> None:
    wire_format = simulation.wire_format
    Decoder(dict.fromkeys(wire_format.characters, wire_format.items)).feed(simulation.wire.data)
