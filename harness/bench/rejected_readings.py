"""True readings that the outlier gates of methods reject: clean synthetic takes of every behaviour.

All methods learn from one database and follow held-out takes, under the conditions of `benchmark_clips`. No reading is
an outlier there, so every rejection is an error.
"""

import math
import tempfile
from collections.abc import Iterable
from pathlib import Path

from harness.bench.limits import hold_to_limit
from harness.core.calibration import Calibration
from harness.reconstruct import Reconstructor, Session
from harness.reconstruct.solver import OutlierGate, SessionReader
from harness.results.findings import BenchmarkStatement
from harness.stream import TrackerFrame
from harness.study.speed import benchmark_clips

GATED_METHODS = (
    *("ik", "local_pca", "dynamic_map", "expert_map", "weighted_blend", "kernel_cca"),
    *("best_match+ik", "kernel_ridge+ik"),
)
MAX_REJECTED_SHARE = 1e-3
FRAMES, CLIP_S = 16_000, 20.0
"""Frames of the database, and length of every held-out take [s]."""


def bench_rejected_readings(seed: int = 1, frames: int = FRAMES, clip_s: float = CLIP_S) -> list[BenchmarkStatement]:
    """The share of rejected positions of each method."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="harness-bench-") as folder:
        takes = benchmark_clips.make_take_factories(frames, seed)
        database = benchmark_clips.build_database(Path(folder) / "examples", takes)
        clips = benchmark_clips.generate_held_out_clips(seed, clip_s)
        for name in GATED_METHODS:
            fitted = benchmark_clips.fit_named_method(name, database, seed)
            counts = [count_rejected(fitted, clip.simulation.calibration, clip.simulation.frames) for clip in clips]
            readings, rejected = (sum(column) for column in zip(*counts, strict=True))
            name, share = f"{name}, rejected true readings", rejected / readings if readings else math.nan
            found = f"{rejected} of {readings} true readings"
            rows.append(hold_to_limit(name, share, most=MAX_REJECTED_SHARE, reference=found))
    return rows


def count_rejected(fitted: Reconstructor, calibration: Calibration, frames: Iterable[TrackerFrame]) -> tuple[int, int]:
    """Number of positions that a new session measured in these frames, and of those that its gate rejected."""
    session = fitted.begin(calibration)
    for frame in frames:
        session.step(frame)
    gate = find_gate(session)
    return gate.readings, gate.rejected


def find_gate(session: Session) -> OutlierGate:
    """The outlier gate of a session; that of the final inverse kinematics where a method has one. TypeError if none."""
    for value in vars(session).values():
        if isinstance(value, SessionReader):
            return value.gate
    raise TypeError(f"{type(session).__name__} has no outlier gate.")
