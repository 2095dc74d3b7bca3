"""Distances of the readings of a station at rest from its resting pose, and the drift of its mean."""

from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.number_format import CHI_QUANTILE, NORMAL_QUANTILE, Interval
from harness.measure.gauss_markov import NOISE_KEYS, ErrorProcess
from harness.measure.noise_fit import NoiseFit
from harness.measure.static_series import StaticSeries

_BLOCK_S = 10.0
"""Length of the blocks whose sums give the interval [s]: ten correlation times of the drift, two excursions."""
_FEWEST_BLOCKS = 4
_ROWS = {"position_m": (0, 1), "rotation_rad": (2, 4)}
"""Rows in `NOISE_KEYS` of the white noise and of the largest drift of a field."""


def rest_distance(series: Sequence[StaticSeries], name: str, share: float) -> Interval:
    """Distance (`position_m`) or angle (`rotation_rad`) from the resting pose that a share of the readings keeps.

    Outliers that are fewer than the rest do not change it. The interval is that of Woodruff (1952, J. Am. Stat. Assoc.
    47): the share of readings below the value varies between blocks of ten seconds; its interval, by Student's t, is
    read off the distribution.
    """
    from scipy import special

    blocks: list[Floats] = []
    for one in series:
        size = round(_BLOCK_S * one.rate_hz)
        distance: Floats = np.linalg.norm(getattr(one, name), axis=1)
        rows = [slice(begin, begin + size) for begin in range(0, len(one) - size + 1, size)]
        blocks += [found for row in rows if len(found := distance[row][one.valid[row]])]
    if len(blocks) < _FEWEST_BLOCKS:
        return Interval.missing(f"{_FEWEST_BLOCKS * _BLOCK_S:g} s of rest are needed.")
    pooled, count = np.concatenate(blocks), len(blocks)
    value = float(np.quantile(pooled, share))
    below = np.array([np.mean(block <= value) for block in blocks])
    half = float(special.stdtrit(count - 1, 0.975) * below.std(ddof=1)) / count**0.5
    low, high = np.quantile(pooled, np.clip([share - half, share + half], 0.0, 1.0)).tolist()
    return Interval(value, min(low, value), max(high, value), len(pooled))


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
