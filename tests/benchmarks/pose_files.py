"""CPU time and memory to read half an hour of six bodies at 120 Hz from CSV, in wide rows and in a row a body."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from harness.bench.limits import hold_to_limit
from harness.core.seeds import generator
from harness.results.findings import BenchmarkStatement

ROWS, RATE_HZ = 30 * 60 * 120, 120.0
BODIES = ("head", "torso", "left_hand", "right_hand", "left_foot", "right_foot")
MAX_CPU_S, MAX_MEMORY_MB = 10.0, 500.0
_AXES = ("x", "y", "z", "qw", "qx", "qy", "qz")
_READ = """
import resource, sys, time
from pathlib import Path
from harness.stream.recording import open_poses
poses = sum(len(body.times_s) for body in open_poses([Path(sys.argv[1])]).log.bodies)
print(poses, time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""
"""A process of its own, so that the memory is that of reading; the CPU time has the start of Python in it."""


def bench_pose_files(seed: int = 1) -> list[BenchmarkStatement]:
    """Read both temporary files of some 100 MB once."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, lines in (("wide", wide_lines(seed)), ("long", long_lines(seed))):
            path = Path(folder) / f"{name}.csv"
            with path.open("w", encoding="utf-8") as file:
                file.writelines(lines)
            words = [sys.executable, "-c", _READ, str(path)]
            poses, cpu_s, memory_mb = subprocess.run(words, capture_output=True, check=True, text=True).stdout.split()
            if int(poses) != ROWS * len(BODIES):
                raise RuntimeError(f"read {poses} of {ROWS * len(BODIES)} poses")
            size = f"{path.stat().st_size / 1e6:.0f} MB of {name} CSV"
            rows.append(hold_to_limit(f"read {size}", float(cpu_s), "s CPU", most=MAX_CPU_S))
            rows.append(hold_to_limit(f"memory for {name} CSV", float(memory_mb), "MB", most=MAX_MEMORY_MB))
            path.unlink()
    return rows


def wide_lines(seed: int) -> Iterator[str]:
    """A row holds all bodies."""
    yield ",".join(["time_s", *(f"{body}.{axis}" for body in BODIES for axis in _AXES)]) + "\n"
    for n, pose in enumerate(_poses(seed)):
        yield f"{n / RATE_HZ:.6f}," + ",".join([pose] * len(BODIES)) + "\n"


def long_lines(seed: int) -> Iterator[str]:
    """A row holds one body."""
    yield "time_s,station,x_m,y_m,z_m,qw,qx,qy,qz\n"
    for n, pose in enumerate(_poses(seed)):
        yield "".join(f"{n / RATE_HZ:.6f},{body},{pose}\n" for body in BODIES)


def _poses(seed: int) -> Iterator[str]:
    """Text of a random path of one body."""
    rng = generator(seed, "bench", "pose files")
    places = np.cumsum(1e-3 * rng.normal(size=(ROWS, 3)), axis=0)
    turns = rng.normal(size=(ROWS, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    for row in np.column_stack([places, turns]).tolist():
        yield ",".join(f"{value:.6f}" for value in row)
