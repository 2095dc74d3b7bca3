"""Rough noise of readings at rest, from robust variances of their differences."""

import math
from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.errors import BadInput
from harness.measure.gauss_markov import NoiseSample
from harness.measure.static_series import StaticSeries

FEWEST_READINGS = 100
"""Fewest readings from which noise is estimated."""
SMALLEST_SHARE = 1e-3
"""Smallest spread that is estimated, as a share of the total spread of its axes."""
_TRIM = 2.5
"""Standard deviations beyond which a difference is left out."""
_MOST_DIFFERENCES = 40_000
"""About the most differences of one lag that are used."""
_LONGEST_LAG_S = 30.0
_NORMAL_MEDIAN = 0.6744897501960817
"""Median of the absolute value of a standard normal variable."""
_TRIMMED_VARIANCE = 1.0 - 2.0 * _TRIM * math.exp(-0.5 * _TRIM**2) / math.sqrt(2.0 * math.pi) / math.erf(
    _TRIM / math.sqrt(2.0)
)
"""Variance of a standard normal variable within the trim."""


def start_values(series: Sequence[StaticSeries], left_out: Sequence[Bools]) -> Floats:
    """Rough logarithms (6,) of the parameters, which echoes, excursions and gaps hardly change; see `NOISE_KEYS`.

    They come from trimmed variances of differences. Those over a lag t have the variance
    2 w^2 + 2 s^2 (1 - exp(-t / tau)). A spread that is not found is a thousandth of the total. BadInput for fewer than
    100 readings.
    """
    return rough_logarithms(noise_samples(series, left_out))


def noise_samples(series: Sequence[StaticSeries], left_out: Sequence[Bools]) -> list[NoiseSample]:
    """The columns of each series; BadInput for fewer than 100 readings in all."""
    samples = [NoiseSample(one, mask) for one, mask in zip(series, left_out, strict=True)]
    readings = sum(sample.readings for sample in samples)
    if readings < FEWEST_READINGS:
        raise BadInput(
            f"{readings} undisturbed readings at rest cannot show the noise.", "Record a longer static stretch."
        )
    return samples


def rough_logarithms(samples: Sequence[NoiseSample]) -> Floats:
    """(6,) logarithms of rough parameters, from the trimmed variances of differences over many lags."""
    from scipy.optimize import nnls  # takes long to load, and few commands need it

    rate_hz = max(sample.rate_hz for sample in samples)
    longest = max(len(sample.used) for sample in samples) // 3
    lags = np.unique(np.rint(np.geomspace(1.0, max(min(_LONGEST_LAG_S * rate_hz, longest), 2.0), 24)).astype(int))
    variances = np.array([[_difference_variance(samples, number, lag) for lag in lags] for number in range(3)])
    lag_s = lags / rate_hz
    best, found = np.inf, np.zeros(6)
    for correlation_s in np.geomspace(0.5 / rate_hz, max(lag_s[-1], 1.0 / rate_hz), 60):
        rise = 1.0 - np.exp(-lag_s / correlation_s)
        whites, drifts, misfit = [], [], 0.0
        for variance in variances:
            known = variance > 0.0
            weight = 1.0 / np.where(known, variance, 1.0) * known
            columns = np.stack([weight, rise * weight], axis=1)
            solution, residual = nnls(columns, variance * weight)
            misfit += residual**2
            whites.append(0.5 * solution[0])
            drifts.append(0.5 * solution[1])
        if misfit < best:
            spreads = [whites[0], drifts[0], (2.0 * whites[1] + whites[2]) / 3.0, drifts[1], drifts[2]]
            best, found = misfit, np.array([*np.sqrt(spreads), correlation_s])
    floor = np.sqrt(np.max(variances, axis=1)) * SMALLEST_SHARE
    floors = np.array([floor[0], floor[0], max(floor[1], floor[2]), floor[1], floor[2], 1e-12])
    out: Floats = np.log(np.maximum(np.maximum(found, floors), 1e-15))
    return out


def _difference_variance(samples: Sequence[NoiseSample], number: int, lag: int) -> float:
    """Variance of differences over a lag of rows, without those beyond 2.5 standard deviations; 0 if unknown."""
    parts = []
    for sample in samples:
        both = sample.used[lag:] & sample.used[:-lag]
        values = sample.groups[number]
        stride = max(len(both) * len(samples) // _MOST_DIFFERENCES, 1)
        rows = np.flatnonzero(both)[::stride]
        parts.append((values[rows + lag] - values[rows]).ravel())
    differences = np.abs(np.concatenate(parts))
    if len(differences) == 0:
        return 0.0
    deviation = float(np.median(differences)) / _NORMAL_MEDIAN
    for _ in range(5):
        near = differences[differences <= _TRIM * deviation]
        deviation = math.sqrt(float(np.mean(near**2)) / _TRIMMED_VARIANCE) if len(near) else 0.0
    return deviation**2
