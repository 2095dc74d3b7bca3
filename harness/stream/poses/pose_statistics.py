"""Rates, pauses and repeats of the bodies of a pose log, in numbers."""

from dataclasses import dataclass

import numpy as np

from harness.stream.poses.pose_log import BodyPoses

GAP_STEPS = 3.0
"""Steps, in median ones, from which on a pause counts as a gap [choice]."""
FEWEST_POSES = 20
"""Fewest poses of a body that `characterize` measures."""


@dataclass(frozen=True)
class BodyStatistics:
    """How one body was sampled."""

    name: str
    poses: int
    duration_s: float
    rate_hz: float | None
    """Inverse of the mean of the steps that are no gaps; None for one pose."""
    step_ms: tuple[float, float] | None
    """Steps between which nine tenths of all lie [ms]; None for one pose."""
    gaps: int
    """Steps of three median steps or more."""
    longest_gap_s: float
    """Longest step [s]; 0 for one pose."""
    repeated_share: float
    """Share of the poses that equal the one before in all seven numbers."""
    extent_m: tuple[float, float, float]
    """Size of the box that holds all positions [m]."""


def measure_sampling(body: BodyPoses) -> BodyStatistics:
    """Measure how a body was sampled."""
    steps_s = np.diff(body.times_s)
    extent = np.ptp(body.positions_m, axis=0)
    size = float(extent[0]), float(extent[1]), float(extent[2])
    if not len(steps_s):
        return BodyStatistics(body.name, 1, 0.0, None, None, 0, 0.0, 0.0, size)
    gap = steps_s >= GAP_STEPS * np.median(steps_s)
    low, high = (1e3 * float(step) for step in np.percentile(steps_s, [5, 95]))
    return BodyStatistics(
        body.name,
        len(body.times_s),
        float(body.times_s[-1] - body.times_s[0]),
        1.0 / float(steps_s[~gap].mean()),
        (low, high),
        int(np.count_nonzero(gap)),
        float(steps_s.max()),
        float(np.mean(body.repeats)),
        size,
    )
