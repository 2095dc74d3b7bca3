"""Speed and memory of the physical simulation, beside the statistical one and bare kinematics.

Stations with noise preset `default` on a synthetic take of boxing, at the tracker's default rate. Motion and body are
made in advance; bytes and frames are included. Times are CPU times of this one thread, and the parts take turns, so
that load on the machine affects all equally. Memory is the peak of a process of its own.
"""

import hashlib
import math
import sys
from collections.abc import Callable
from functools import cache, partial

import numpy as np

from harness.bench import common
from harness.bench.cpu_time import time_cpu
from harness.bench.limits import hold_to_limit
from harness.bench.peak_memory import peak_bytes
from harness.body import DEFAULT_MOUNTS, Body, Mount, retarget_to_own_body
from harness.core.child_process import run_python
from harness.core.motion import BodyMotion
from harness.mocap import synthetic
from harness.results.findings import BenchmarkStatement
from harness.simulate import Clock, Noise, Simulation, TrackerConfig, noise_preset, simulate_tracker
from harness.simulate.physics import PhysicalTracker, Physics
from harness.stream.polhemus.codec import BITS_PER_BYTE, STANDARD_LIST, record_size

MOUNTS = (
    *common.MOUNTS,
    *(DEFAULT_MOUNTS[name] for name in ("left_hand", "right_hand", "left_foot", "right_foot", "pelvis")),
    Mount("left_upper_arm", "lhumerus", 0.5, math.pi / 2.0),
)
"""Twelve stations; the first six are those of `bench stream`."""
SECONDS = 20.0
_LENGTHS_S = 60.0, 240.0
"""Lengths of the takes whose memory is measured [s]."""
_BAUD = 2 * len(MOUNTS) * 40 * record_size(STANDARD_LIST) * BITS_PER_BYTE
"""Speed of a line that carries twelve stations at 40 Hz twice [bit/s]."""
_BLOCKS = 1, 7, 80, 400
"""Sizes of a block whose bytes are compared [slots]."""
MAX_TIME_RATIO, MAX_MEMORY_RATIO = 12.0, 1.3
"""Most time and peak memory, relative to the simulation with statistical errors."""
MIN_SPEED_PERCENT = 10.0
"""Least speed of six stations, as a share of that of bare kinematics [%]."""
PHYSICAL = Noise(clock=Clock(), physics=Physics())


def bench_physics(seed: int = 1, repeats: int = 5) -> list[BenchmarkStatement]:
    """Medians over `repeats` turns; each turn is one take of 20 s for each contender."""
    body, take = _boxing(seed, SECONDS)
    rows = []
    for count in (6, 12):
        parts: tuple[Callable[[], object], ...] = (
            partial(simulate_stations, body, take, count, PHYSICAL, seed),
            partial(simulate_stations, body, take, count, noise_preset("default"), seed),
            lambda: common.pose_all(body, np.asarray(take.qpos)),
        )
        parts[0]()
        seconds = np.array([[time_cpu(part) for part in parts] for _ in range(repeats)])
        physical_s, statistical_s, kinematics_s = np.median(seconds, axis=0).tolist()
        reference = (
            f"statistical errors {SECONDS / statistical_s:.0f} x; bare kinematics of {len(take)} poses "
            f"{SECONDS / kinematics_s:.0f} x"
        )
        name, ratio = f"{count} stations, 40 Hz", physical_s / statistical_s
        rows += [
            hold_to_limit(name, SECONDS / physical_s, "x real time", reference=reference),
            hold_to_limit(f"{name}: time / that of statistical errors", ratio, "x", most=MAX_TIME_RATIO),
        ]
        if count == len(common.MOUNTS):
            name = f"{name}: speed / that of bare kinematics"
            rows.append(hold_to_limit(name, 100.0 * kinematics_s / physical_s, "%", least=MIN_SPEED_PERCENT))
    return [*rows, *_memory_rows(seed), _block_row(body, take, seed)]


def simulate_stations(body: Body, take: BodyMotion, count: int, noise: Noise, seed: int) -> Simulation:
    """Simulate the first `count` stations on a line that is fast enough for twelve."""
    return simulate_tracker(body, take, MOUNTS[:count], TrackerConfig(baud=_BAUD), noise, seed=seed)


@cache
def _boxing(seed: int, seconds: float) -> tuple[Body, BodyMotion]:
    clip = synthetic.generate("boxing", synthetic.performer_names()[0], 1, seed=seed, duration_s=seconds)
    return retarget_to_own_body(clip)


def _memory_rows(seed: int) -> list[BenchmarkStatement]:
    rows = []
    for seconds in _LENGTHS_S:
        physical, statistical = (_measure_peak(kind, seconds, seed) for kind in ("physics", "default"))
        name = f"peak memory / that of statistical errors, {seconds:.0f} s"
        reference = f"{physical / 2**20:.0f} and {statistical / 2**20:.0f} MB"
        rows.append(hold_to_limit(name, physical / statistical, "x", most=MAX_MEMORY_RATIO, reference=reference))
    return rows


def _block_row(body: Body, take: BodyMotion, seed: int) -> BenchmarkStatement:
    digests = set()
    default = PhysicalTracker.block_slots
    try:
        for slots in _BLOCKS:
            PhysicalTracker.block_slots = slots
            digests.add(hashlib.sha256(simulate_stations(body, take, 6, PHYSICAL, seed).wire.data).hexdigest())
    finally:
        PhysicalTracker.block_slots = default
    sizes = ", ".join(map(str, _BLOCKS))
    name, reference = "different bytes among block sizes", f"blocks of {sizes} slots"
    return hold_to_limit(name, len(digests) - 1.0, most=0.0, reference=reference)


def _measure_peak(kind: str, seconds: float, seed: int) -> int:
    return int(run_python("harness.bench.physics.speed", kind, str(seconds), str(seed)))


if __name__ == "__main__":
    _kind, _seconds, _seed = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
    _noise = PHYSICAL if _kind == "physics" else noise_preset(_kind)
    simulate_stations(*_boxing(_seed, _seconds), 6, _noise, _seed)
    print(peak_bytes())
