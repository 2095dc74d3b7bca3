"""Whitening of white noise plus a first-order Gauss-Markov process, by a Kalman filter, across gaps of any length.

The filter is linear in the values: it may be applied to a signal that was added to the noise, and it has a transpose.
"""

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled


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
