"""White noise and first-order Gauss-Markov drift of readings at rest: parameters and likelihood.

Each axis of a series is a constant, plus drift with the covariance s^2 exp(-t / tau), plus white noise. The likelihood
is that of a Kalman filter over the records that are used, so it is exact with any gaps (Schweppe 1965, IEEE Trans.
Inf. Theory 11). The constant is integrated out with a flat prior (restricted likelihood), which removes the bias of
subtracting a mean (Harville 1977, J. Am. Stat. Assoc. 72).
"""

import math

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.measure.static_series import StaticSeries

NOISE_KEYS = (
    "components.white.position_m",
    "components.drift.position_m",
    "components.white.orientation_rad",
    "components.drift.pitch_roll_rad",
    "components.drift.yaw_rad",
    "components.drift.correlation_s",
)
"""Dotted keys of the parameters, in the order of their vectors."""
AXIS_GROUPS = ((0, 1), (2, 3), (2, 4))
"""Rows of the white noise and of the drift of each group of axes: position, pitch and roll, yaw."""
CORRELATION = 5
"""Row of the correlation time."""


class NoiseSample:
    """Columns of position, of pitch and roll, and of yaw of one series, and the rows that are used."""

    def __init__(self, series: StaticSeries, left_out: Bools) -> None:
        self.used = np.ascontiguousarray(series.valid & ~left_out)
        self.rate_hz = series.rate_hz
        self.readings = int(self.used.sum())
        self.duration_s = series.duration_s
        turn = series.rotation_rad
        self.groups = tuple(np.ascontiguousarray(part) for part in (series.position_m, turn[:, :2], turn[:, 2:]))

    def log_likelihood(self, number: int, white: float, drift: float, correlation_s: float) -> float:
        """Restricted log-likelihood of a group of axes."""
        correlation = math.exp(-1.0 / (self.rate_hz * correlation_s))
        return series_log_likelihood(self.groups[number], self.used, correlation, drift**2, white**2)

    def spread(self, number: int) -> Floats:
        """Standard deviation of each axis of a group; empty without two readings."""
        part = self.groups[number][self.used]
        out: Floats = np.std(part, axis=0) if len(part) > 1 else np.zeros(0)
        return out


@compiled
def series_log_likelihood(
    columns: Floats, used: Bools, correlation: float, drift_variance: float, white_variance: float
) -> float:
    """Restricted log-likelihood of A independent axes (N, A) with one unknown constant each, over the used rows (N,).

    `correlation` is that of the drift from one row to the next. The variance of a prediction becomes constant soon
    after each gap; its logarithm is then not computed again.
    """
    rows, axes = columns.shape
    predicted = np.zeros(axes)
    squares = np.zeros(axes)
    crosses = np.zeros(axes)
    one, ones = 0.0, 0.0
    variance, noise = drift_variance, drift_variance * (1.0 - correlation * correlation)
    total, gain, log_innovation, inverse = 0.0, 0.0, 0.0, 0.0
    steady = False
    count = 0
    for row in range(rows):
        if not used[row]:
            variance = correlation * correlation * variance + noise
            one *= correlation
            for axis in range(axes):
                predicted[axis] *= correlation
            steady = False
            continue
        if not steady:
            innovation = variance + white_variance
            gain = variance / innovation
            inverse = 1.0 / innovation
            log_innovation = math.log(innovation)
            after = correlation * correlation * variance * white_variance * inverse + noise
            steady = abs(after - variance) <= 1e-14 * variance
            variance = after
        count += 1
        total += log_innovation
        rest = 1.0 - one
        ones += rest * rest * inverse
        one = correlation * (one + gain * rest)
        for axis in range(axes):
            error = columns[row, axis] - predicted[axis]
            squares[axis] += error * error * inverse
            crosses[axis] += error * rest * inverse
            predicted[axis] = correlation * (predicted[axis] + gain * error)
    if count < 2:
        return 0.0
    misfit = 0.0
    for axis in range(axes):
        misfit += squares[axis] - crosses[axis] * crosses[axis] / ones
    constant = (count - 1) * math.log(2.0 * math.pi)
    out: float = -0.5 * (misfit + axes * (total + math.log(ones) + constant))
    return out
