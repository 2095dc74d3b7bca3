"""Offset between two clocks, and which station is on which body, from the angular speeds of the same motion.

Angular speed is the same in every frame, so neither room nor mounts need to be known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.core.motion import count_steps
from harness.errors import BadInput, NotComparable
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline
from harness.measure.sampling import mean_period_s

LEAST_GAIN = 0.1
"""Least gain in the mean correlation of the stations concerned with which an exchange is believed [choice]."""
SPAN_S = 0.2
"""Time over which angular speeds are means [s]: over single steps, noise and rounded times hide them [choice]."""
_FEWEST_STEPS = 20
_RIVAL_S, _RIVAL_CORRELATION = 1.0, 0.02
"""Two offsets this far apart [s] whose correlations differ by less than this are rivals [choice]."""
LEAST_OVERLAP_S = 10.0
"""Shortest common motion of capture and reference [s]."""


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
    rival_s: float | None = None
    """Another offset at which a motion that repeats correlates as well [s]; None without one."""


def angular_speed(poses: TruthSpline, period_s: float, span_s: float = SPAN_S) -> SpeedSeries:
    """Mean angular speed over `span_s` around each place of a grid of `period_s` [s]; NaN where a gap is in the span.

    The poses need no even rate: they are resampled by their spline.
    """
    count_steps(float(poses.time_s[-1] - poses.time_s[0]), period_s, "Times of poses")
    grid_s = np.arange(poses.time_s[0], poses.time_s[-1], period_s)
    turn, covered = poses.poses(grid_s)[1], poses.covers(grid_s)
    steps = max(round(span_s / period_s), 1)
    known = np.append(0, np.cumsum(covered))
    whole = known[steps + 1 :] - known[: -steps - 1] == steps + 1
    speed = rotations.angle_between_rad(turn[:-steps], turn[steps:]) / (steps * period_s)
    return SpeedSeries(grid_s[0] + 0.5 * steps * period_s, period_s, np.where(whole, speed, np.nan))


def time_offset(first: Sequence[SpeedSeries], second: Sequence[SpeedSeries]) -> TimeOffset:
    """Find the offset at which pairs of angular speeds correlate best; all pairs share the two clocks.

    All series have one period. The offset is refined to a fraction of it by a parabola. Of several offsets that
    correlate as well, as for a motion that repeats, the one with the longest overlap is taken. NotComparable if no
    offset leaves `LEAST_OVERLAP_S` of overlap [s].
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
    enough = overlap_s >= LEAST_OVERLAP_S
    if not enough.any():
        raise NotComparable(
            f"Capture and reference overlap by at most {overlap_s.max():.1f} s.",
            f"At least {LEAST_OVERLAP_S:g} s of common motion are needed for the time offset.",
        )
    # Short overlaps correlate by chance: the lower end of Fisher's interval ranks the lags.
    correlation = np.where(enough, total[0] / np.maximum(total[1], 1e-300), -1.0)
    independent = total[2] * min(period_s / SPAN_S, 1.0)
    score = np.arctanh(np.clip(correlation, -0.999999, 0.999999)) - 3.0 / np.sqrt(np.maximum(independent - 3.0, 1.0))
    score = np.where(enough, score, -np.inf)
    best = int(np.argmax(score))
    rivals = _rivals(correlation, enough, best, int(_RIVAL_S / period_s))
    best = max(best, *rivals, key=lambda lag: float(overlap_s[lag])) if len(rivals) else best
    others = _rivals(correlation, enough, best, int(_RIVAL_S / period_s))

    def offset_at(lag: int) -> float:
        return float(origin_a - origin_b + (lag - (length_b - 1) + _parabola(correlation, lag)) * period_s)

    rival_s = offset_at(max(others, key=lambda lag: float(score[lag]))) if len(others) else None
    return TimeOffset(offset_at(best), float(correlation[best]), float(overlap_s[best]), rival_s)


def _rivals(correlation: Floats, enough: Bools, best: int, apart: int) -> list[int]:
    """Peaks among the correlations (L,), `apart` from the best one, that are nearly as high."""
    peak = np.zeros(len(correlation), bool)
    peak[1:-1] = (correlation[1:-1] >= correlation[:-2]) & (correlation[1:-1] >= correlation[2:])
    far = np.abs(np.arange(len(correlation)) - best) > apart
    high = correlation > correlation[best] - _RIVAL_CORRELATION
    return [int(lag) for lag in np.flatnonzero(peak & far & enough & high)]


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


def coarse_offset(
    stations: Mapping[str, MeasuredPoses],
    splines: Mapping[str, TruthSpline],
) -> TimeOffset:
    """Offset of the device's clock from that of the reference, from the angular speeds of all stations."""
    period_s = mean_period_s([station.measured_s for station in stations.values()])
    measured = [angular_speed(station.orientations(), period_s) for station in stations.values()]
    expected = [angular_speed(splines[name], period_s) for name in stations]
    return time_offset(measured, expected)


def identify_stations(
    stations: Mapping[str, MeasuredPoses], truths: Mapping[str, TruthPoses], stated: Mapping[str, str]
) -> dict[str, str]:
    """The body of each station: the stated one, unless another assignment correlates clearly better.

    The assignment has the largest sum of correlations between the angular speed of a station and that of a body
    (Kuhn 1955), over the time offsets of the stated assignment and of the first station on each body: one of those is
    right. Bodies that no station is stated to be on are not considered.
    """
    names, bodies = list(stations), list(dict.fromkeys(stated[name] for name in stations))
    if len(names) < 2 or len(bodies) < len(names):
        return dict(stated)
    splines = {body: TruthSpline(truths[body]) for body in bodies}

    def correlations(worn: Mapping[str, str]) -> Floats:
        on = {name: splines[body] for name, body in worn.items()}
        offset_s = coarse_offset({name: stations[name] for name in worn}, on).offset_s
        return np.array([_correlations(stations[name], splines, offset_s) for name in names])

    rows, own = np.arange(len(names)), [bodies.index(stated[name]) for name in names]
    as_stated = correlations(stated)
    assigned = [_assigned(as_stated), *(_assigned(correlations({names[0]: body})) for body in bodies)]
    columns, correlation = max(assigned, key=lambda one: float(one[1].sum()))
    changed = columns != np.array(own)
    gain = correlation[changed] - as_stated[rows, own][changed]
    if not changed.any() or gain.mean() < LEAST_GAIN:
        return dict(stated)
    return {name: bodies[column] for name, column in zip(names, columns, strict=True)}


def _assigned(correlation: Floats) -> tuple[Ints, Floats]:
    """The body of each station (N,) and its correlation (N,), of correlations (N, B) with the largest sum."""
    from scipy import optimize

    rows, columns = optimize.linear_sum_assignment(-correlation)
    return columns, correlation[rows, columns]


def _correlations(station: MeasuredPoses, splines: Mapping[str, TruthSpline], offset_s: float) -> list[float]:
    """Correlation of the station's angular speed with that of each body; 0 with too little in common."""
    known = station.valid & np.isfinite(station.measured_s)
    time_s, turn = station.measured_s[known], station.tracker_from_station[known]
    span = 4
    middle_s, step_s = 0.5 * (time_s[span:] + time_s[:-span]) - offset_s, time_s[span:] - time_s[:-span]
    measured = _angle(turn[:-span], turn[span:]) / np.maximum(step_s, 1e-6)
    usable = (step_s > 0.0) & (step_s < 3.0 * np.median(step_s))
    out = []
    for spline in splines.values():
        rows = usable & spline.covers(middle_s - step_s) & spline.covers(middle_s + step_s)
        if rows.sum() < _FEWEST_STEPS:
            out.append(0.0)
            continue
        before, after = (spline.poses(middle_s[rows] + sign * 0.5 * step_s[rows])[1] for sign in (-1.0, 1.0))
        expected = _angle(before, after) / step_s[rows]
        with np.errstate(invalid="ignore"):  # of a body that does not turn
            pair = np.corrcoef(measured[rows], expected)[0, 1]
        out.append(float(pair) if np.isfinite(pair) else 0.0)
    return out


def _angle(first: Floats, second: Floats) -> Floats:
    out: Floats = 2.0 * np.arccos(np.clip(np.abs(np.sum(first * second, axis=1)), 0.0, 1.0))
    return out
