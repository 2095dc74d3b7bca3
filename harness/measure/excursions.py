"""Excursions at rest: displacements of seconds that come and go (`components.excursion`).

White noise and a Gauss-Markov process together are an ARMA(1,1) process, whose innovations are white. In the
innovations of the position a filter that is matched to a displacement of some duration finds it, the three axes summed;
under noise alone the sum is chi-square with three degrees of freedom. Found displacements are subtracted, and the
search goes on until nothing is left.
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.runs import find_runs
from harness.measure.static_series import StaticSeries

THRESHOLD = 36.0
"""Least squared signal-to-noise ratio of an excursion: noise alone exceeds it once in about ten station hours."""
STAYS_S = tuple(float(0.4 * 1.2**k) for k in range(19))
"""Durations of the matched filters, from the onset to the beginning of the return [s]."""
DEFAULT_RAMP_S = 0.2
_EDGE_S = 0.3
"""An excursion that begins earlier in the series has begun before it, and is not counted [s]."""
_TAIL_S = 0.5
"""Time after an excursion in which its innovations fade [s]."""
_SHORT_GAP, _AFTER_GAP = 8, 3
"""Longest gap after which nothing is left out, and samples that are left out after a longer one: the position may have
drifted meanwhile."""
_ROUNDS = 5


@dataclass(frozen=True)
class ExcursionNoise:
    """Noise of the position on each axis, among which excursions are searched."""

    white_m: float
    drift_m: float
    correlation_s: float


@dataclass(frozen=True)
class ExcursionEvent:
    """One excursion of a station."""

    station: str
    begin_s: float
    """Onset since the beginning of the series [s]."""
    stay_s: float
    """Time from onset to the beginning of the return [s]."""
    size_m: float
    """Displacement [m], corrected for the noise in its length."""
    score: float
    """Squared signal-to-noise ratio."""
    is_whole: bool
    """Whether it begins and ends within the series."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """An excursion in units of the innovations."""

    onset: float
    """Place of the onset, in samples."""
    stay_s: float
    size: Floats
    """(3,) displacement in standard deviations of an innovation."""
    score: float


@dataclass(frozen=True, eq=False)
class Innovations:
    """Innovations of a series in units of their standard deviation."""

    values: Floats
    """(N, 3) innovations; 0 where samples do not count."""
    valid: Bools
    """(N,) samples that count."""


@dataclass(frozen=True, eq=False)
class ExcursionSearch:
    """Excursions of one series, and the innovations that are left without them."""

    events: list[ExcursionEvent]
    residual: Innovations


class ExcursionDetector:
    """Finds excursions in series of one rate."""

    def __init__(self, rate_hz: float, noise: ExcursionNoise, ramp_s: float = DEFAULT_RAMP_S) -> None:
        self._rate_hz, self._noise, self._ramp_s = rate_hz, noise, ramp_s
        self._ar = float(np.exp(-1.0 / (rate_hz * noise.correlation_s)))
        gain, self._sigma_m = _steady_state(self._ar, noise.drift_m, noise.white_m)
        self._ma = self._ar * (1.0 - gain)
        shapes = [self._shape(stay_s) for stay_s in STAYS_S]
        self._bank = [self._filter(shape[:, None], np.ones(len(shape), bool))[:, 0] for shape in shapes]

    def innovations(self, series: StaticSeries, left_out: Bools) -> Innovations:
        """Innovations of a series, without the samples in `left_out` (N,) and those that follow a long gap."""
        valid = series.valid & ~left_out
        for first, end in find_runs(~valid).tolist():
            if end - first > _SHORT_GAP:
                valid[end : end + _AFTER_GAP] = False
        position_m = series.position_m - np.nanmedian(series.position_m[valid], axis=0) if valid.any() else None
        if position_m is None:
            return Innovations(np.zeros((len(series), 3)), valid)
        return Innovations(self._filter(np.where(valid[:, None], position_m, 0.0), valid) / self._sigma_m, valid)

    def _filter(self, values: Floats, valid: Bools) -> Floats:
        """Innovations (K, A) of values (K, A) that hold their last valid one; 0 where they are not valid."""
        from scipy import signal

        row = np.maximum.accumulate(np.where(valid, np.arange(len(valid)), -1))
        held = np.where((row >= 0)[:, None], values[row], 0.0)
        out: Floats = signal.lfilter([1.0, -self._ar], [1.0, -self._ma], held, axis=0)
        return np.where(valid[:, None], out, 0.0)

    def search(self, innovations: Innovations, station: str) -> ExcursionSearch:
        """Find the excursions in innovations, strongest first, and take them out."""
        residual = Innovations(innovations.values.copy(), innovations.valid)
        found: list[_Fit] = []
        for _ in range(_ROUNDS):
            new = []
            for start in self._strongest(residual):
                fit = self._refine(residual, *start)
                if fit.score >= THRESHOLD:
                    new.append(self._subtract(residual, fit))
            if not new:
                break
            found = [fit for fit in self._refit(residual, found + new) if fit.score >= THRESHOLD]
        events = [self._event(station, len(residual.valid), fit) for fit in sorted(found, key=lambda fit: fit.onset)]
        return ExcursionSearch(events, residual)

    def _refit(self, residual: Innovations, fits: list["_Fit"]) -> list["_Fit"]:
        """Each excursion again, with the others taken out; one that is too weak then goes back into the residual."""
        out = []
        for fit in fits:
            self._add(residual, fit.onset, fit.stay_s, fit.size)
            again = self._refine_edges(residual, fit.onset, fit.stay_s)
            out.append(self._subtract(residual, again) if again.score >= THRESHOLD else again)
        return out

    def _subtract(self, residual: Innovations, fit: "_Fit") -> "_Fit":
        self._add(residual, fit.onset, fit.stay_s, -fit.size)
        return fit

    def innovations_of(self, displacement_m: Floats, valid: Bools) -> Floats:
        """Innovations (N, 3) that a displacement (N, 3) [m] adds to those of a series with these valid samples."""
        return self._filter(displacement_m, valid) / self._sigma_m

    def _shape(self, stay_s: float, fraction: float = 0.0) -> Floats:
        """Share (K,) of a displacement that begins this fraction of a period after the first sample."""
        ramp_s = max(self._ramp_s, 1e-6)
        count = int(np.ceil((stay_s + ramp_s + _TAIL_S) * self._rate_hz)) + 1
        since_s = (np.arange(count) - fraction) / self._rate_hz
        out: Floats = np.clip(np.minimum(since_s, stay_s + ramp_s - since_s) / ramp_s, 0.0, 1.0)
        return out

    def _strongest(self, residual: Innovations) -> list[tuple[int, float]]:
        """Onsets and stays of the strongest excursions that do not touch each other."""
        from scipy import signal

        best = np.full(len(residual.valid), -1.0)
        which = np.zeros(len(residual.valid), dtype=np.int64)
        for number, template in enumerate(self._bank):
            if len(template) > len(residual.valid):
                continue
            matched = signal.oaconvolve(residual.values, template[::-1, None], mode="full", axes=0)[len(template) - 1 :]
            score = np.sum(matched**2, axis=1) / np.sum(template**2)
            better = score > best
            best[better], which[better] = score[better], number
        found: list[tuple[int, float]] = []
        while True:
            onset = int(np.argmax(best))
            if best[onset] < THRESHOLD:
                return found
            stay_s = STAYS_S[which[onset]]
            found.append((onset, stay_s))
            reach = round((stay_s + 1.0) * self._rate_hz)
            best[max(onset - reach, 0) : onset + reach] = -1.0

    def _refine(self, residual: Innovations, onset: float, stay_s: float) -> "_Fit":
        """The best excursion near a place: first coarsely, then to a fraction of a period."""
        best = self._fit(residual, onset, stay_s)
        reach_s = max(0.2 * stay_s, 0.15)
        for _ in range(2):
            middle = best
            for begins_s in np.linspace(-reach_s, reach_s, 9).tolist():
                for ends_s in np.linspace(-reach_s, reach_s, 9).tolist():
                    longer_s = middle.stay_s + ends_s - begins_s
                    if longer_s * self._rate_hz >= 1.0:
                        fit = self._fit(residual, middle.onset + begins_s * self._rate_hz, longer_s)
                        best = fit if fit.score > best.score else best
            reach_s *= 0.25
        return self._refine_edges(residual, best.onset, best.stay_s)

    def _refine_edges(self, residual: Innovations, onset: float, stay_s: float) -> "_Fit":
        """Onset and end of an excursion, in turn, by steps that become smaller."""
        best = self._fit(residual, onset, stay_s)
        for step in (1.0, 0.5, 0.25, 0.125):
            for begins, ends in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
                while True:
                    longer_s = best.stay_s + (ends - begins) / self._rate_hz
                    if longer_s * self._rate_hz < 1.0:
                        break
                    fit = self._fit(residual, best.onset + begins, longer_s)
                    if fit.score <= best.score:
                        break
                    best = fit
        return best

    def _fit(self, residual: Innovations, onset: float, stay_s: float) -> "_Fit":
        """The displacement of least squares of an excursion with this onset and stay."""
        power, x, y, z = fit_trapezoid(residual.values, residual.valid, *self._timing(onset, stay_s))
        if power <= 0.0:
            return _Fit(onset, stay_s, np.zeros(3), 0.0)
        size = np.array([x, y, z]) / power
        return _Fit(onset, stay_s, size, float(size @ size) * power)

    def _add(self, innovations: Innovations, onset: float, stay_s: float, size: Floats) -> None:
        add_trapezoid(innovations.values, innovations.valid, *self._timing(onset, stay_s), size)

    def _timing(self, onset: float, stay_s: float) -> tuple[float, float, float, int, float, float]:
        """What the compiled functions need: onset, stay, ramp and tail in samples, and the two coefficients."""
        ramp = max(self._ramp_s, 1e-6) * self._rate_hz
        return onset, stay_s * self._rate_hz, ramp, round(_TAIL_S * self._rate_hz), self._ar, self._ma

    def _event(self, station: str, samples: int, fit: "_Fit") -> ExcursionEvent:
        length_m = self._sigma_m * float(np.sqrt(fit.size @ fit.size))
        variance_m2 = length_m**2 / max(fit.score, 1e-9)  # of one axis
        end = fit.onset + (fit.stay_s + 2.0 * self._ramp_s) * self._rate_hz
        whole = fit.onset >= _EDGE_S * self._rate_hz and end < samples
        size_m = float(np.sqrt(max(length_m**2 - 2.0 * variance_m2, 0.0)))
        return ExcursionEvent(station, fit.onset / self._rate_hz, fit.stay_s, size_m, fit.score, whole)


def _steady_state(ar: float, drift_m: float, white_m: float) -> tuple[float, float]:
    """Gain of the Kalman filter after many samples, and the standard deviation of its innovations [m]."""
    process = drift_m**2 * (1.0 - ar**2)
    white = max(white_m, 1e-3 * drift_m, 1e-9) ** 2
    # The predicted variance p solves p = ar^2 p w / (p + w) + q.
    half = 0.5 * (process - white * (1.0 - ar**2))
    predicted = half + np.sqrt(half**2 + process * white)
    return float(predicted / (predicted + white)), float(np.sqrt(predicted + white))


@compiled
def fit_trapezoid(
    values: Floats, valid: Bools, onset: float, stay: float, ramp: float, tail: int, ar: float, ma: float
) -> tuple[float, float, float, float]:
    """Power of an excursion's innovations, and their products with innovations (N, 3); times are in samples.

    Where a sample is not valid, the displacement is held, and the innovation does not count.
    """
    first = max(int(np.floor(onset)), 0)
    last = min(int(np.floor(onset)) + int(np.ceil(stay + ramp)) + tail + 1, len(valid))
    power, x, y, z = 0.0, 0.0, 0.0, 0.0
    before, innovation = 0.0, 0.0
    for i in range(first, last):
        now = before
        if valid[i]:
            now = max(min(min(i - onset, onset + stay + ramp - i) / ramp, 1.0), 0.0)
        innovation = now - ar * before + ma * innovation
        before = now
        if valid[i]:
            power += innovation * innovation
            x += innovation * values[i, 0]
            y += innovation * values[i, 1]
            z += innovation * values[i, 2]
    return power, x, y, z


@compiled
def add_trapezoid(
    values: Floats,
    valid: Bools,
    onset: float,
    stay: float,
    ramp: float,
    tail: int,
    ar: float,
    ma: float,
    size: Floats,
) -> None:
    """Add an excursion of size (3,) to innovations (N, 3) in place; see `fit_trapezoid`."""
    first = max(int(np.floor(onset)), 0)
    last = min(int(np.floor(onset)) + int(np.ceil(stay + ramp)) + tail + 1, len(valid))
    before, innovation = 0.0, 0.0
    for i in range(first, last):
        now = before
        if valid[i]:
            now = max(min(min(i - onset, onset + stay + ramp - i) / ramp, 1.0), 0.0)
        innovation = now - ar * before + ma * innovation
        before = now
        if valid[i]:
            for axis in range(3):
                values[i, axis] += innovation * size[axis]
