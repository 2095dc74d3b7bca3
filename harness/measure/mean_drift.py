"""Drift of the mean: the constant velocity of a resting station's readings, with its interval."""

from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Bools
from harness.core.number_format import CHI_QUANTILE, NORMAL_QUANTILE, Interval
from harness.measure.correlated_errors import ErrorProcess
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.noise_fit import NoiseFit
from harness.measure.static_series import StaticSeries

_ROWS = {"position_m": (0, 1), "rotation_rad": (2, 4)}
"""Rows in `NOISE_KEYS` of the white noise and of the largest drift of a field."""


def mean_drift(
    series: Sequence[StaticSeries], left_out: Sequence[Bools], noise: NoiseFit, name: str
) -> tuple[Interval, ...]:
    """Velocity (3) of `position_m` [m/s] or `rotation_rad` [rad/s] along each axis, over all series of one station.

    Each series has its own constant, so slow changes between series do not count. The fit is by generalised least
    squares with the noise of all stations, which whitens readings and line alike. Of the drift of orientations that of
    yaw is used for each axis, so intervals of pitch and roll are rather too wide. `left_out` masks rows (N,). Not
    measured where the noise is unknown.
    """
    white, drift = (noise.all_stations[NOISE_KEYS[row]] for row in _ROWS[name])
    correlation = noise.all_stations[NOISE_KEYS[-1]]
    if not (white.is_measured and drift.is_measured and white.value + drift.value > 0.0):
        return (Interval.missing("The noise of the station is not known."),) * 3
    process = ErrorProcess(white.value, drift.value, correlation.value if correlation.is_measured else 1.0)
    information, pull, readings = 0.0, np.zeros(3), 0
    for one, mask in zip(series, left_out, strict=True):
        used = one.valid & ~mask
        readings += int(used.sum())
        line = np.stack([np.ones(len(one)), np.arange(len(one)) / one.rate_hz], axis=1)
        columns = np.concatenate([line, np.nan_to_num(getattr(one, name))], axis=1)
        whitened = process.whiten(columns, used, 1.0 / one.rate_hz)[used]
        unit, slope, values = whitened[:, 0], whitened[:, 1], whitened[:, 2:]
        if len(unit) < 2:
            continue
        slope = slope - unit * (unit @ slope) / (unit @ unit)
        information += float(slope @ slope)
        pull += slope @ values
    if information <= 0.0:
        return (Interval.missing("Too few undisturbed readings at rest."),) * 3
    return tuple(Interval.normal(float(one) / information, information**-0.5, readings) for one in pull)


def drift_speed(velocity: Sequence[Interval]) -> Interval:
    """Length of a velocity (3) with equal deviations, in its unit.

    The interval is 95 % for a vector of three errors (chi with three degrees of freedom), so that it contains zero for
    95 % of the stations without drift.
    """
    if not all(one.is_measured for one in velocity):
        return Interval.missing(next(one.reason for one in velocity if one.reason))
    length = float(np.sqrt(sum(one.value**2 for one in velocity)))
    half = CHI_QUANTILE * max(one.high - one.value for one in velocity) / NORMAL_QUANTILE
    return Interval(length, max(length - half, 0.0), length + half, velocity[0].count)
