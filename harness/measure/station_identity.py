"""Which station is on which body, from their angular speeds, which no mount and no room changes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline

LEAST_GAIN = 0.1
"""Least gain in the mean correlation of the stations concerned with which an exchange is believed [choice]."""
_FEWEST_STEPS = 20
_LEAST_OVERLAP_S = 10.0


def identify_stations(
    stations: Mapping[str, MeasuredPoses], truths: Mapping[str, TruthPoses], stated: Mapping[str, str]
) -> dict[str, str]:
    """The body of each station: the stated one, unless another assignment correlates clearly better.

    The assignment has the largest sum of correlations between the angular speed of a station and that of a body
    (Kuhn 1955), over the time offsets of the stated assignment and of the first station on each body: one of those is
    right. Bodies that no station is stated to be on are not considered.
    """
    from harness.measure.registration import coarse_offset, record_period_s

    names, bodies = list(stations), list(dict.fromkeys(stated[name] for name in stations))
    if len(names) < 2 or len(bodies) < len(names):
        return dict(stated)
    splines = {body: TruthSpline(truths[body]) for body in bodies}
    period_s = record_period_s(stations)

    def correlations(worn: Mapping[str, str]) -> Floats:
        on = {name: splines[body] for name, body in worn.items()}
        offset_s = coarse_offset({name: stations[name] for name in worn}, on, period_s, _LEAST_OVERLAP_S).offset_s
        return np.array([_correlations(stations[name], splines, offset_s) for name in names])

    rows, own = np.arange(len(names)), [bodies.index(stated[name]) for name in names]
    as_stated = correlations(stated)
    found = max((_assigned(as_stated), *(_assigned(correlations({names[0]: body})) for body in bodies)), key=_total)
    changed = found.body != np.array(own)
    gain = found.correlation[changed] - as_stated[rows, own][changed]
    if not changed.any() or gain.mean() < LEAST_GAIN:
        return dict(stated)
    return {name: bodies[column] for name, column in zip(names, found.body, strict=True)}


@dataclass(frozen=True, eq=False)
class _Assignment:
    """The body of each station (N,) and its correlation (N,)."""

    body: Ints
    correlation: Floats


def _assigned(correlation: Floats) -> _Assignment:
    """The assignment with the largest sum of correlations (N, B)."""
    from scipy import optimize

    rows, columns = optimize.linear_sum_assignment(-correlation)
    return _Assignment(columns, correlation[rows, columns])


def _total(assignment: _Assignment) -> float:
    return float(assignment.correlation.sum())


def _correlations(station: MeasuredPoses, splines: Mapping[str, TruthSpline], offset_s: float) -> list[float]:
    """Correlation of the station's angular speed with that of each body; 0 with too little in common."""
    known = station.valid & np.isfinite(station.measured_s)
    time_s, turn = station.measured_s[known], station.tracker_from_station[known]
    lag = 4
    middle_s, step_s = 0.5 * (time_s[lag:] + time_s[:-lag]) - offset_s, time_s[lag:] - time_s[:-lag]
    measured = _angle(turn[:-lag], turn[lag:]) / np.maximum(step_s, 1e-6)
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
