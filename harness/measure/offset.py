"""Offset between two clocks, from the angular speeds of the same motion.

Angular speed is the same in every frame, so neither room nor mounts need to be known.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, freeze
from harness.core.motion import count_steps
from harness.errors import BadInput, NotComparable


@dataclass(frozen=True, eq=False)
class SpeedSeries:
    """K angular speeds on a uniform grid."""

    begin_s: float
    """Time of the first value [s]."""
    period_s: float
    """Step of the grid [s]."""
    rad_s: Floats
    """(K,) angular speed [rad/s]; NaN where not known."""

    def __post_init__(self) -> None:
        freeze(self, rad_s=("K",))


@dataclass(frozen=True)
class TimeOffset:
    """Offset of one clock from another."""

    offset_s: float
    """Time by the first clock minus time by the second at the same instant [s]."""
    correlation: float
    """Correlation of the angular speeds at this offset, up to 1."""
    overlap_s: float
    """Time for which both have angular speeds at this offset [s]."""


def angular_speed(time_s: Floats, quaternions: Floats, valid: Bools, period_s: float) -> SpeedSeries:
    """Angular speed between consecutive poses (N, 4), which are put on a grid of `period_s` [s].

    Of several poses at one place of the grid the last counts. BadInput without a valid pose.
    """
    rows = np.flatnonzero(valid & np.isfinite(time_s))
    if not len(rows):
        raise BadInput("No pose has a time.", "Send time stamps with the records.")
    begin_s = float(time_s[rows].min())
    count_steps(float(time_s[rows].max()) - begin_s, period_s, "Times of poses")
    place = np.round((time_s[rows] - begin_s) / period_s).astype(np.int64)
    turn, at_s = np.full((place.max() + 1, 4), np.nan), np.full(place.max() + 1, np.nan)
    turn[place], at_s[place] = quaternions[rows], time_s[rows]
    step_s = np.diff(at_s)
    angle = np.full(len(step_s), np.nan)
    known = np.isfinite(step_s) & (step_s > 0.0)
    angle[known] = rotations.angle_between_rad(turn[:-1][known], turn[1:][known]) / step_s[known]
    return SpeedSeries(begin_s + 0.5 * period_s, period_s, angle)


def time_offset(
    first: Sequence[SpeedSeries], second: Sequence[SpeedSeries], *, least_overlap_s: float = 10.0
) -> TimeOffset:
    """Find the offset at which pairs of angular speeds correlate best; all pairs share the two clocks.

    All series have one period. The offset is refined to a fraction of it by a parabola. NotComparable if no offset
    leaves `least_overlap_s` of overlap [s].
    """
    period_s = first[0].period_s
    if any(abs(series.period_s - period_s) > 1e-9 * period_s for series in (*first, *second)):
        raise BadInput("Angular speeds of different periods.", "Put all on one grid.")
    origin_a, origin_b = min(s.begin_s for s in first), min(s.begin_s for s in second)
    for series, origin_s in ((first, origin_a), (second, origin_b)):
        count_steps(max(s.begin_s for s in series) - origin_s, period_s, "Beginnings of the bodies' motion")
    lags: list[Floats] = []
    for a, b in zip(first, second, strict=True):
        lags.append(_sums(_padded(a, origin_a), _padded(b, origin_b)))
    length_a = max(len(_padded(a, origin_a)) for a in first)
    length_b = max(len(_padded(b, origin_b)) for b in second)
    total = np.zeros((3, length_a + length_b - 1))
    for b, sums in zip(second, lags, strict=True):
        begin = length_b - len(_padded(b, origin_b))
        total[:, begin : begin + sums.shape[1]] += sums
    overlap_s = total[2] * period_s / len(first)
    enough = overlap_s >= least_overlap_s
    if not enough.any():
        raise NotComparable(
            f"Capture and reference overlap by at most {overlap_s.max():.1f} s.",
            f"At least {least_overlap_s:g} s of common motion are needed for the time offset.",
        )
    # Short overlaps correlate by chance: the lower end of Fisher's interval ranks the lags.
    correlation = np.where(enough, total[0] / np.maximum(total[1], 1e-300), -1.0)
    score = np.arctanh(np.clip(correlation, -0.999999, 0.999999)) - 3.0 / np.sqrt(np.maximum(total[2] - 3.0, 1.0))
    best = int(np.argmax(np.where(enough, score, -np.inf)))
    shift = best - (length_b - 1) + _parabola(correlation, best)
    offset_s = origin_a - origin_b + shift * period_s
    return TimeOffset(float(offset_s), float(correlation[best]), float(overlap_s[best]))


def _padded(series: SpeedSeries, origin_s: float) -> Floats:
    """The series from `origin_s` on, shifted to its grid; NaN before its beginning."""
    before = max(round((series.begin_s - origin_s) / series.period_s), 0)
    out: Floats = np.concatenate([np.full(before, np.nan), series.rad_s])
    return out


def _sums(a: Floats, b: Floats) -> Floats:
    """(3, lags) covariance, product of the spreads, and count, of a masked cross-correlation."""
    from scipy.signal import fftconvolve

    known_a, known_b = np.isfinite(a).astype(float), np.isfinite(b)[::-1].astype(float)
    x, y = np.where(np.isfinite(a), a, 0.0), np.where(np.isfinite(b), b, 0.0)[::-1]
    count = np.maximum(np.round(fftconvolve(known_a, known_b)), 0.0)
    sum_x, sum_y = fftconvolve(x, known_b), fftconvolve(known_a, y)
    n = np.maximum(count, 1.0)
    var_x = np.maximum(fftconvolve(x**2, known_b) - sum_x**2 / n, 0.0)
    var_y = np.maximum(fftconvolve(known_a, y**2) - sum_y**2 / n, 0.0)
    cross = fftconvolve(x, y) - sum_x * sum_y / n
    return np.stack([cross, np.sqrt(var_x * var_y), count])


def _parabola(values: Floats, best: int) -> float:
    """Place of the peak of a parabola through three values, relative to the middle one, within half a step."""
    if not 0 < best < len(values) - 1:
        return 0.0
    left, middle, right = values[best - 1 : best + 2]
    bend = left - 2.0 * middle + right
    return float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0
