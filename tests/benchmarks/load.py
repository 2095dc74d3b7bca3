"""Time to load a motion file of 5,000 frames, beside the time to split its text into numbers."""

import tempfile
import time
from pathlib import Path

import numpy as np

from harness.bench.limits import hold_to_limit
from harness.core.humanoid24 import standard_skeleton
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.mocap import read_amc
from harness.results.findings import BenchmarkStatement

FRAMES = 5000
MAX_RATIO = 3.0
"""Most CPU time to load a file, relative to that to split its text."""


def bench_load(seed: int = 1, repeats: int = 5) -> list[BenchmarkStatement]:
    """Medians over `repeats` of reading a temporary file of random angles."""
    skeleton = standard_skeleton()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.amc"
        path.write_text(amc_text(skeleton, generator(seed, "bench", "load")))
        seconds = np.array([[_time_loading(path, skeleton), _time_splitting(path)] for _ in range(repeats)])
    load_s, split_s = np.median(seconds, axis=0).tolist()
    return [
        hold_to_limit(f"load a {FRAMES}-frame AMC", load_s, "s CPU", reference=f"splitting its text {split_s:.3f} s"),
        hold_to_limit("load / split", load_s / split_s, "x", most=MAX_RATIO, reference="the same runs"),
    ]


def amc_text(skeleton: Skeleton, rng: np.random.Generator) -> str:
    """Text of an AMC file of random angles, with as many digits as CMU's files."""
    bones = [(n, len(c)) for n, c in zip(skeleton.names, skeleton.hinges, strict=True) if c]
    rows = [":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(1, FRAMES + 1):
        rows.append(str(frame))
        for name, count in [("root", 6), *bones]:
            rows.append(" ".join([name, *(f"{x:.6g}" for x in rng.normal(0.0, 30.0, count))]))
    return "\n".join(rows) + "\n"


def _time_loading(path: Path, skeleton: Skeleton) -> float:
    start = time.process_time()
    clip = read_amc(path, skeleton, rate_hz=120.0)
    seconds = time.process_time() - start
    if len(clip) != FRAMES:
        raise RuntimeError(f"read {len(clip)} of {FRAMES} frames")
    return seconds


def _time_splitting(path: Path) -> float:
    start = time.process_time()
    for line in path.read_text().splitlines():
        [float(word) for word in line.split()[1:] if word]
    return time.process_time() - start
