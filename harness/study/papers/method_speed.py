"""How many frames a second methods follow, and how long a step takes.

They take turns on held-out takes, a second each (`harness.experiment.round_robin_timing`); the first second of a take is not counted, and its
first frame stands apart.
"""

import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from harness.experiment import benchmark_clips
from harness.experiment.round_robin_timing import MethodTimings, time_method, time_round_robin
from harness.study.papers.speed_dataset import SpeedDataset

REFERENCE_METHOD = "ik"
"""Beside which every other runs, in the same turns."""
_CPUINFO = Path("/proc/cpuinfo")


@dataclass(frozen=True)
class MethodSpeed:
    """One method with one database."""

    method: str
    frames: int
    """Learnt from."""
    steps: int
    """That were timed."""
    fps: float
    """1 / mean step."""
    p50_ms: float
    p99_ms: float
    first_ms: float
    """The slowest first frame of a take."""
    ready_s: float
    """To learn, and to begin a session."""
    to_ik: float
    """How many times as fast as `ik` in the median turn."""
    error_deg: float


def measure_speed(methods: Sequence[str], motion: SpeedDataset, seed: int) -> list[MethodSpeed]:
    """Speed of methods that learn from a database and take turns on the held-out takes; `ik` must be among them."""
    ready_s, contenders = {}, {}
    for name in methods:
        start = perf_counter()
        learnt = benchmark_clips.fit_named_method(name, motion.database, seed)
        learnt.begin(motion.test_clips[0].simulation.calibration)
        ready_s[name], contenders[name] = perf_counter() - start, time_method(learnt)
    tallies = time_round_robin(contenders, motion.test_clips, lambda *_: None)
    return [
        _method_speed(name, len(motion.database), ready_s[name], tallies[name], tallies[REFERENCE_METHOD])
        for name in methods
    ]


def _method_speed(name: str, frames: int, ready_s: float, own: MethodTimings, beside: MethodTimings) -> MethodSpeed:
    p50_ms, p99_ms = np.percentile(own.step_ms, [50, 99]).tolist()
    return MethodSpeed(
        method=name,
        frames=frames,
        steps=len(own.step_ms),
        fps=1e3 / float(np.mean(own.step_ms)),
        p50_ms=p50_ms,
        p99_ms=p99_ms,
        first_ms=max(own.first_ms),
        ready_s=ready_s,
        to_ik=float(np.median(np.array(beside.turn_s) / np.array(own.turn_s))),
        error_deg=float(np.mean(own.error_deg)),
    )


def processor_name() -> str:
    """The processor's name, as far as the system tells it."""
    lines = _CPUINFO.read_text(encoding="utf-8").splitlines() if _CPUINFO.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {len(names)} cores" if names else platform.processor() or platform.machine()
