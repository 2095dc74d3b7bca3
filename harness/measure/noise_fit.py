"""Maximum likelihood of the noise of readings at rest, with intervals, for all stations and for each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.number_format import NORMAL_QUANTILE, Interval
from harness.errors import BadInput
from harness.measure.gauss_markov import AXIS_GROUPS, CORRELATION, NOISE_KEYS, NoiseSample
from harness.measure.static_series import StaticSeries

FEWEST_READINGS = 100
"""Fewest readings from which noise is estimated."""
SMALLEST_SHARE = 1e-3
"""Smallest spread that is estimated, as a share of the total spread of its axes."""
_TRIM = 2.5
"""Standard deviations beyond which a difference is left out."""
_MOST_DIFFERENCES = 40_000
"""About the most differences of one interval that are used."""
_LONGEST_LAG_S = 30.0
_NORMAL_MEDIAN = 0.6744897501960817
"""Median of the absolute value of a standard normal variable."""
_TRIMMED_VARIANCE = 1.0 - 2.0 * _TRIM * math.exp(-0.5 * _TRIM**2) / math.sqrt(2.0 * math.pi) / math.erf(
    _TRIM / math.sqrt(2.0)
)
"""Variance of a standard normal variable within the trim."""


def start_values(series: Sequence[StaticSeries], left_out: Sequence[Bools]) -> Floats:
    """Rough logarithms (6,) of the parameters, which echoes, excursions and gaps hardly change; see `NOISE_KEYS`.

    They come from trimmed variances of differences. Those over a time t have the variance
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
    variances = np.array([[_difference_variance(samples, number, rows) for rows in lags] for number in range(3)])
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


def _difference_variance(samples: Sequence[NoiseSample], number: int, interval: int) -> float:
    """Variance of differences over an interval of rows, without those beyond 2.5 standard deviations; 0 if unknown."""
    parts = []
    for sample in samples:
        both = sample.used[interval:] & sample.used[:-interval]
        values = sample.groups[number]
        stride = max(len(both) * len(samples) // _MOST_DIFFERENCES, 1)
        rows = np.flatnonzero(both)[::stride]
        parts.append((values[rows + interval] - values[rows]).ravel())
    differences = np.abs(np.concatenate(parts))
    if len(differences) == 0:
        return 0.0
    deviation = float(np.median(differences)) / _NORMAL_MEDIAN
    for _ in range(5):
        near = differences[differences <= _TRIM * deviation]
        deviation = math.sqrt(float(np.mean(near**2)) / _TRIMMED_VARIANCE) if len(near) else 0.0
    return deviation**2


_FLAT = 0.15
"""Standard deviation of a logarithm above which its interval is read off the profile likelihood."""
_ROUNDING = 1e-12
"""Spread below which readings are constant, in their unit."""
_LIKELIHOOD_DROP = 0.5 * NORMAL_QUANTILE**2
"""Drop of the log-likelihood at the ends of a 95 % interval."""
_DRIFTS = tuple(drift for _, drift in AXIS_GROUPS)
"""Rows of the drift's spreads."""
_STEP = 3e-3
"""Step of the differences that give slope and information, in natural logarithms."""
_LONGEST_STEP = 1.0
"""Longest step of the search in each logarithm."""
_TOLERANCE = 1e-5
"""Expected gain of the log-likelihood below which the search ends."""
_ROUGH_TOLERANCE = 3e-3
"""Expected gain below which a search along a profile of the likelihood ends."""
_MOST_STEPS = 60


@dataclass(frozen=True)
class NoiseFit:
    """Parameters by `NOISE_KEYS`, of all stations together and of each."""

    all_stations: Mapping[str, Interval]
    by_station: Mapping[str, Mapping[str, Interval]]


def fit_noise(series: Sequence[StaticSeries], left_out: Sequence[Bools], *, by_station: bool = True) -> NoiseFit:
    """Fit the noise of stations at rest; `left_out` masks rows (N,) of each series, such as excursions.

    Intervals come from the observed information of logarithms, or from the profile likelihood where a parameter is
    hardly observable. The count of a parameter is the number of independent normal values whose spread would be known
    as well. A spread of less than a thousandth of its axes' spread is 0. Without `by_station` only all stations
    together are fitted. BadInput for fewer than 100 readings.
    """
    samples = noise_samples(series, left_out)
    together = _Likelihood(samples).fit(rough_logarithms(samples))
    stations: dict[str, Mapping[str, Interval]] = {}
    for name in dict.fromkeys(one.station for one in series) if by_station else ():
        own = [sample for one, sample in zip(series, samples, strict=True) if one.station == name]
        if sum(sample.readings for sample in own) < FEWEST_READINGS:
            stations[name] = dict.fromkeys(NOISE_KEYS, Interval.missing("Too few undisturbed readings at rest."))
        else:
            stations[name] = _Likelihood(own).fit(rough_logarithms(own))
    return NoiseFit(together, stations)


class _Likelihood:
    """Log-likelihood of the six logarithms over samples of the same noise, and its maximum."""

    def __init__(self, samples: Sequence[NoiseSample]) -> None:
        self._samples = samples
        self._known: dict[tuple[int, float, float, float], float] = {}
        spread = [_spread(samples, number) for number in range(len(AXIS_GROUPS))]
        orientation = max(spread[1], spread[2])
        self._groups = [number for number, size in enumerate(spread) if size > 0.0]
        least_s = 0.25 / max(sample.rate_hz for sample in samples)
        with np.errstate(divide="ignore"):
            least = SMALLEST_SHARE * np.array([spread[0], spread[0], orientation, spread[1], spread[2]])
            self._low = np.log([*least, least_s])
        self._high = math.log(sum(sample.duration_s for sample in samples))

    def fit(self, start: Floats) -> dict[str, Interval]:
        """Find the maximum near the logarithms `start` (6,), and the interval of each parameter."""
        free = np.isfinite(self._low)
        free[CORRELATION] = bool(self._groups)
        values, best, hessian = self._climb(np.where(free, np.maximum(start, self._low), self._low), free)
        absent = values <= self._low + 1e-9
        absent[CORRELATION] = bool(absent[list(_DRIFTS)].all())
        inner = np.flatnonzero(free & ~absent)
        deviations = np.zeros(len(NOISE_KEYS))
        if len(inner):
            deviations[inner] = np.sqrt(np.abs(np.diag(np.linalg.inv(-hessian[np.ix_(inner, inner)]))))
        out = {}
        for row, key in enumerate(NOISE_KEYS):
            if row == CORRELATION and absent[row]:
                out[key] = Interval.missing("There is no drift whose time could be measured.")
            elif not free[row]:
                out[key] = Interval(0.0, 0.0, 0.0, sum(sample.readings for sample in self._samples))
            elif absent[row] or deviations[row] > _FLAT:
                out[key] = self._profile(values, free, row, best, bool(absent[row]))
            else:
                value, half = float(values[row]), NORMAL_QUANTILE * float(deviations[row])
                low, high = math.exp(value - half), math.exp(value + half)
                out[key] = Interval(math.exp(value), low, high, _equivalent(float(deviations[row])))
        return out

    def _profile(self, values: Floats, free: Bools, row: int, best: float, absent: bool) -> Interval:
        """A parameter with the interval in which its profile likelihood is high enough."""
        value = 0.0 if absent else math.exp(values[row])
        low = 0.0 if absent else math.exp(self._end(values, free, row, best, -1.0))
        high = math.exp(self._end(values, free, row, best, 1.0))
        return Interval(value, min(low, value), max(high, value), 1)

    def _climb(self, start: Floats, free: Bools, tolerance: float = _TOLERANCE) -> tuple[Floats, float, Floats]:
        """Maximum over the free parameters, its log-likelihood and the second derivatives there (6, 6).

        Newton's method, since the intervals need the second derivatives anyway. L-BFGS-B of `scipy.optimize` computes
        2.8 times as many likelihoods (2,751 and 975 for the stations of tests/measure/test_noise_fit.py in 300 s).
        """
        values, damping = start.copy(), 0.0
        best, slope, hessian = self._derivatives(values)
        for _ in range(_MOST_STEPS):
            inner = free & ~((values <= self._low) & (slope <= 0.0)) & ~((values >= self._top()) & (slope >= 0.0))
            if not inner.any():
                break
            part = np.ix_(inner, inner)
            step, gain = _newton_step(slope[inner], hessian[part], damping)
            if gain < tolerance:
                break
            trial = values.copy()
            trial[inner] += np.clip(step, -_LONGEST_STEP, _LONGEST_STEP)
            trial = np.where(free, np.clip(trial, self._low, self._top()), values)
            if np.array_equal(trial, values):
                break
            if self(trial) > best:
                values, damping = trial, 0.1 * damping if damping > 1e-4 else 0.0
                best, slope, hessian = self._derivatives(values)
            else:
                damping = max(10.0 * damping, 1e-3)
        return values, best, hessian

    def _top(self) -> Floats:
        return np.array([np.inf] * CORRELATION + [self._high])

    def __call__(self, log_values: Floats) -> float:
        return sum(self._group(number, log_values[self._rows(number)]) for number in self._groups)

    @staticmethod
    def _rows(number: int) -> list[int]:
        return [*AXIS_GROUPS[number], CORRELATION]

    def _group(self, number: int, logs: Floats) -> float:
        white, drift, correlation_s = np.exp(logs).tolist()
        key = (number, white, drift, correlation_s)
        if key not in self._known:
            self._known[key] = sum(
                sample.log_likelihood(number, white, drift, correlation_s) for sample in self._samples
            )
        return self._known[key]

    def _derivatives(self, log_values: Floats) -> tuple[float, Floats, Floats]:
        """Log-likelihood, slope (6,) and second derivatives (6, 6) by central differences."""
        total, slope, hessian = 0.0, np.zeros(6), np.zeros((6, 6))
        for number in self._groups:
            rows = self._rows(number)
            at = log_values[rows]
            steps = _STEP * np.eye(3)
            here = self._group(number, at)
            up = np.array([self._group(number, at + step) for step in steps])
            down = np.array([self._group(number, at - step) for step in steps])
            total += here
            slope[rows] += (up - down) / (2.0 * _STEP)
            for i in range(3):
                hessian[rows[i], rows[i]] += (up[i] + down[i] - 2.0 * here) / _STEP**2
                for j in range(i):
                    both = self._group(number, at + steps[i] + steps[j]) + self._group(number, at - steps[i] - steps[j])
                    mixed = (both - up[i] - down[i] - up[j] - down[j] + 2.0 * here) / (2.0 * _STEP**2)
                    hessian[rows[i], rows[j]] += mixed
                    hessian[rows[j], rows[i]] += mixed
        return total, slope, hessian

    def _end(self, values: Floats, free: Bools, row: int, best: float, direction: float) -> float:
        """Logarithm at which the profile likelihood of a parameter has dropped to the end of its 95 % interval."""
        from scipy.optimize import brentq

        rest = free.copy()
        rest[row] = False
        near = values.copy()

        def drop(log_value: float) -> float:
            near[row] = log_value
            near[:], height, _ = self._climb(near, rest, _ROUGH_TOLERANCE)
            return best - height - _LIKELIHOOD_DROP

        limit = float(self._low[row] if direction < 0.0 else self._top()[row])
        inside, stride = float(values[row]), 0.5
        while direction * (limit - inside) > 0.0:
            outside = inside + direction * min(stride, direction * (limit - inside))
            if drop(outside) >= 0.0:
                return float(brentq(drop, inside, outside, xtol=0.01)) if drop(inside) < 0.0 else inside
            inside, stride = outside, 2.0 * stride
        return -math.inf if direction < 0.0 else limit


def _newton_step(slope: Floats, hessian: Floats, damping: float) -> tuple[Floats, float]:
    """A step uphill (K,) and its expected gain; directions in which the curve is not concave are turned round."""
    size, axes = np.linalg.eigh(-hessian)
    size = np.maximum(np.abs(size), 1e-6 * np.max(np.abs(size)) + 1e-12) * (1.0 + damping) + damping * np.max(
        np.abs(size)
    )
    step: Floats = axes @ ((axes.T @ slope) / size)
    return step, float(0.5 * slope @ step)


def _spread(samples: Sequence[NoiseSample], number: int) -> float:
    """Standard deviation of a group of axes within its series; 0 below rounding errors."""
    spread = float(np.sqrt(np.mean(np.concatenate([sample.spread(number) for sample in samples]) ** 2)))
    return spread if spread > _ROUNDING else 0.0


def _equivalent(deviation: float) -> int:
    """Number of normal values whose standard deviation has a logarithm with this standard deviation."""
    return max(round(0.5 / deviation**2), 1) if deviation > 0.0 else 0
