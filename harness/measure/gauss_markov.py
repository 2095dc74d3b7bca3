"""White noise and first-order Gauss-Markov drift of readings: parameters, likelihood, whitening, least squares.

Each axis of a series is a constant, plus drift with the covariance s^2 exp(-t / tau), plus white noise. The likelihood
is that of a Kalman filter over the records that are used, so it is exact with any gaps (Schweppe 1965, IEEE Trans.
Inf. Theory 11). The constant is integrated out with a flat prior (restricted likelihood), which removes the bias of
subtracting a mean (Harville 1977, J. Am. Stat. Assoc. 72). The filter is linear in the values: it also whitens a signal
that was added to the noise, and derivatives, so that ordinary least squares of both is generalised least squares.
"""

import math
from dataclasses import dataclass
from typing import Any

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
_LEAST, _MOST = np.log([1e-9, 1e-9, 0.05]), np.log([10.0, 10.0, 30.0])


@compiled
def kalman_gains(
    valid: Bools, correlation: float, drift_variance: float, white_variance: float
) -> tuple[Floats, Floats]:
    """Gain and standard deviation of the innovation (N,) at each sample; both are 0 where it is not valid."""
    count = len(valid)
    gain, deviation = np.zeros(count), np.zeros(count)
    variance = drift_variance
    for i in range(count):
        variance = correlation**2 * variance + drift_variance * (1.0 - correlation**2)
        if valid[i]:
            gain[i] = variance / (variance + white_variance)
            deviation[i] = np.sqrt(variance + white_variance)
            variance *= 1.0 - gain[i]
    return gain, deviation


@compiled
def whiten(values: Floats, valid: Bools, gain: Floats, deviation: Floats, correlation: float) -> Floats:
    """Innovations (N, A) of values (N, A), in standard deviations; 0 where they are not valid."""
    count, axes = values.shape
    out = np.zeros((count, axes))
    state = np.zeros(axes)
    for i in range(count):
        for a in range(axes):
            state[a] *= correlation
            if valid[i]:
                innovation = values[i, a] - state[a]
                state[a] += gain[i] * innovation
                out[i, a] = innovation / deviation[i]
    return out


@compiled
def transpose_whiten(values: Floats, valid: Bools, gain: Floats, deviation: Floats, correlation: float) -> Floats:
    """The transpose of `whiten`, a linear map, applied to innovations (N, A)."""
    count, axes = values.shape
    out = np.zeros((count, axes))
    state = np.zeros(axes)
    for back in range(count):
        i = count - 1 - back
        for a in range(axes):
            if valid[i]:
                out[i, a] = values[i, a] / deviation[i] + gain[i] * state[a]
                state[a] -= out[i, a]
            state[a] *= correlation
    return out


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


@dataclass(frozen=True)
class ErrorProcess:
    """Standard deviations of white noise and of a Gauss-Markov process, and its correlation time."""

    white: float
    drift: float
    correlation_s: float

    def whiten(self, values: Floats, valid: Bools, period_s: float) -> Floats:
        """Filter the columns (N, C) of one axis, sampled every `period_s` [s]; rows that are not valid become zero."""
        if self.drift == 0.0:
            out: Floats = np.where(valid[:, None], values, 0.0) / self.white
            return out
        correlation = float(np.exp(-period_s / self.correlation_s))
        gain, deviation = kalman_gains(valid, correlation, self.drift**2, self.white**2)
        return whiten(np.ascontiguousarray(values), valid, gain, deviation, correlation)


def fit_process(errors: Floats, valid: Bools, period_s: float) -> ErrorProcess:
    """Fit the process to errors (N, A) of A axes by maximum likelihood."""
    from scipy import optimize

    known = np.where(valid[:, None], errors, 0.0)
    spread = float(np.sqrt(np.mean(known[valid] ** 2))) if valid.any() else 0.0
    both = valid[1:] & valid[:-1]
    step = float(np.sqrt(np.mean((errors[1:] - errors[:-1])[both] ** 2) / 2.0)) if both.any() else spread

    def cost(logarithms: Floats) -> float:
        bounded = np.clip(logarithms, _LEAST, _MOST)
        white, drift, correlation_s = np.exp(bounded)
        correlation = float(np.exp(-period_s / correlation_s))
        fit = series_log_likelihood(known, valid, correlation, float(drift**2), float(white**2))
        return float(np.sum((logarithms - bounded) ** 2)) - float(fit) / max(int(valid.sum()), 1)

    start: Floats = np.log(np.maximum([0.7 * min(step, spread), spread, 1.0], 1e-8))
    corners = np.concatenate([start[None], start + np.diag([-0.5, 0.5, 0.5])])
    options: dict[str, Any] = {"initial_simplex": corners, "xatol": 0.01, "fatol": 1e-5, "maxiter": 300}
    found: Any = optimize.minimize(cost, start, method="Nelder-Mead", options=options)  # type: ignore[call-overload]  # its stubs know no simplex
    white, drift, correlation_s = np.exp(np.clip(found.x, _LEAST, _MOST)).tolist()
    return ErrorProcess(white, drift, correlation_s)
