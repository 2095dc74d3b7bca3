"""Excursions at rest: displacements of seconds that come and go (`components.excursion`).

The innovations of a Kalman filter for white noise and a Gauss-Markov process are white, also after gaps. In the
innovations of the position a filter that is matched to a displacement of some onset and duration finds it, the three
axes summed; under noise alone the sum is chi-square with three degrees of freedom. A displacement is a rise and a
return, so that one filter for a rise gives the sums of all durations. Found displacements are subtracted, and the
search goes on until nothing is left.
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.compiled import compiled
from harness.measure.gauss_markov import ErrorProcess, kalman_gains, transpose_whiten, whiten
from harness.measure.static_series import StaticSeries

THRESHOLD = 45.0
"""Least squared signal-to-noise ratio of an excursion: noise alone exceeds it once in some hundred hours."""
LONGEST_STAY_S = 10.6
"""Longest excursion that is searched, from the onset to the beginning of the return [s]."""
RAMP_S = 0.2
"""Time in which an excursion rises, and in which it returns [s]."""
_SHORTEST_STAY_S = 0.3
_STEP_S = 0.025
"""Step of the onsets that are searched [s]; that of the durations is twice as long."""
_EDGE_S = 0.3
"""An excursion that begins earlier in the series has begun before it, and is not counted [s]."""
_TAIL_S = 0.8
"""Time after an excursion in which its innovations fade [s]."""
_SHARED_EDGE_S = 0.3
"""Edges of two excursions that are nearer may be one [s]."""
_SEEN = 0.8
"""Share of samples around an edge that must count for its time to be certain."""
_ROUNDS = 6


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
    is_timed: bool
    """Whether its rise and its return are seen; in a gap their times are uncertain."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """An excursion, its times in samples."""

    onset: float
    """Place of the onset, in samples."""
    stay_s: float
    size: Floats
    """(3,) displacement [m]."""
    score: float


@dataclass(frozen=True, eq=False)
class Innovations:
    """Innovations of a series in units of their standard deviation, and the filter that made them."""

    values: Floats
    """(N, 3) innovations; 0 where samples do not count."""
    valid: Bools
    """(N,) samples that count."""
    gain: Floats
    """(N,) gain of the Kalman filter."""
    deviation_m: Floats
    """(N,) standard deviation of an innovation [m]."""


class ExcursionDetector:
    """Finds excursions in series of one rate, among noise of the position with this process on each axis [m]."""

    def __init__(self, rate_hz: float, noise: ErrorProcess) -> None:
        self._rate_hz, self._noise = rate_hz, noise
        self._correlation = float(np.exp(-1.0 / (rate_hz * noise.correlation_s)))
        self._white_m = max(noise.white, 1e-3 * noise.drift, 1e-9)
        self._stride = max(round(_STEP_S * rate_hz), 1)
        longest = round(LONGEST_STAY_S * rate_hz)
        self._stays = np.arange(max(round(_SHORTEST_STAY_S * rate_hz), 1), longest + 1, 2 * self._stride)
        self._power, self._edge_power = self._undisturbed_power()

    def _undisturbed_power(self) -> tuple[Floats, float]:
        """Power of excursions of the durations (D,) that are searched, and of a rise alone, without any gap."""
        start = 2 * round(2.0 * self._rate_hz)
        count = start + int(self._stays[-1]) + round((RAMP_S + _TAIL_S) * self._rate_hz) + 2
        nothing = self._whiten(np.zeros((count, 3)), np.ones(count, bool))
        power = [self._fit_power(nothing, float(start), float(stay)) for stay in self._stays.tolist()]
        return np.array(power), float(self._rise_power(nothing)[start])

    def _fit_power(self, innovations: Innovations, onset: float, stay: float) -> float:
        return fit_trapezoid(*self._arguments(innovations, onset, stay / self._rate_hz))[0]

    def _rise_power(self, innovations: Innovations) -> Floats:
        """(N,) power of a rise that begins at each sample, as far as its innovations have faded."""
        horizon = round((RAMP_S + _TAIL_S) * self._rate_hz)
        arrays = innovations.valid, innovations.gain, innovations.deviation_m
        return rise_power(*arrays, RAMP_S * self._rate_hz, horizon, self._correlation)

    def innovations(self, series: StaticSeries, left_out: Bools) -> Innovations:
        """Innovations of a series without the samples in `left_out` (N,)."""
        valid = series.valid & ~left_out
        if not valid.any():
            return self._whiten(np.zeros((len(series), 3)), valid)
        place_m = series.position_m - np.nanmedian(series.position_m[valid], axis=0)
        return self._whiten(np.where(valid[:, None], place_m, 0.0), valid)

    def _whiten(self, place_m: Floats, valid: Bools) -> Innovations:
        gain, deviation_m = kalman_gains(valid, self._correlation, self._noise.drift**2, self._white_m**2)
        return Innovations(whiten(place_m, valid, gain, deviation_m, self._correlation), valid, gain, deviation_m)

    def displaced(self, innovations: Innovations, displacement_m: Floats) -> Innovations:
        """The innovations of the same series with a displacement (N, 3) added [m]."""
        valid, gain, deviation_m = innovations.valid, innovations.gain, innovations.deviation_m
        added = whiten(displacement_m, valid, gain, deviation_m, self._correlation)
        return Innovations(innovations.values + added, valid, gain, deviation_m)

    def search(self, innovations: Innovations, station: str) -> tuple[list[ExcursionEvent], Innovations]:
        """Find the excursions in innovations, strongest first, and the innovations that are left without them."""
        valid, gain, deviation_m = innovations.valid, innovations.gain, innovations.deviation_m
        residual = Innovations(innovations.values.copy(), valid, gain, deviation_m)
        rise = self._rise_power(residual)
        found: list[_Fit] = []
        for _ in range(_ROUNDS):
            new = []
            for start in self._strongest(residual, rise):
                fit = self._refine_edges(residual, *start)
                if fit.score >= THRESHOLD:
                    new.append(self._subtract(residual, fit))
            if not new:
                break
            found = [fit for fit in self._refit(residual, found + new) if fit.score >= THRESHOLD]
            found = self._merge(residual, found)
        events = [self._event(station, residual.valid, fit) for fit in sorted(found, key=lambda fit: fit.onset)]
        return events, residual

    def _refit(self, residual: Innovations, fits: list["_Fit"]) -> list["_Fit"]:
        """Each excursion again, with the others taken out; one that is too weak then goes back into the residual."""
        out = []
        for fit in fits:
            self._add(residual, fit.onset, fit.stay_s, fit.size)
            again = self._refine_edges(residual, fit.onset, fit.stay_s)
            out.append(self._subtract(residual, again) if again.score >= THRESHOLD else again)
        return out

    def _merge(self, residual: Innovations, fits: list["_Fit"]) -> list["_Fit"]:
        """Make one excursion of two that have an edge in common, where one explains the innovations nearly as well."""
        out = sorted(fits, key=lambda fit: fit.onset)
        number = 0
        while number < len(out) - 1:
            merged = None
            for other in range(number + 1, len(out)):
                merged = self._merge_two(residual, out[number], out[other])
                if merged is not None:
                    out = sorted([fit for i, fit in enumerate(out) if i not in (number, other)] + [merged], key=_onset)
                    number = max(number - 1, 0)
                    break
            number += merged is None
        return out

    def _merge_two(self, residual: Innovations, one: "_Fit", other: "_Fit") -> "_Fit | None":
        """One excursion in the place of two, subtracted; None, and nothing changed, if two are needed."""
        edges = [(fit.onset, fit.onset + fit.stay_s * self._rate_hz) for fit in (one, other)]
        common = _SHARED_EDGE_S * self._rate_hz
        if not any(abs(a - b) < common for a in edges[0] for b in edges[1]):
            return None
        places = sorted(edges[0] + edges[1])
        rows = slice(max(int(places[0]) - 1, 0), int(places[-1] + (RAMP_S + _TAIL_S) * self._rate_hz) + 3)
        kept = residual.values[rows].copy()
        for fit in (one, other):
            self._add(residual, fit.onset, fit.stay_s, fit.size)
        best: _Fit | None = None
        for begin in edges[0] + edges[1]:
            for end in edges[0] + edges[1]:
                if end - begin >= 1.0:
                    fit = self._fit(residual, begin, (end - begin) / self._rate_hz)
                    best = fit if best is None or fit.score > best.score else best
        if best is not None:
            merged = self._subtract(residual, self._refine_edges(residual, best.onset, best.stay_s))
            if float(np.sum(residual.values[rows] ** 2)) < float(np.sum(kept**2)) + THRESHOLD:
                return merged
        residual.values[rows] = kept
        return None

    def _subtract(self, residual: Innovations, fit: "_Fit") -> "_Fit":
        self._add(residual, fit.onset, fit.stay_s, -fit.size)
        return fit

    def _strongest(self, residual: Innovations, rise: Floats) -> list[tuple[float, float]]:
        """Onsets and stays of the strongest excursions that do not touch each other."""
        count, ramp = len(residual.valid), RAMP_S * self._rate_hz
        arrays = residual.values, residual.valid, residual.gain, residual.deviation_m
        place = transpose_whiten(*arrays, self._correlation)
        best, which = search_durations(
            *rise_products(place, ramp), rise, self._stays, self._power, self._edge_power, self._stride
        )
        before = int(np.ceil(ramp))
        found: list[tuple[float, float]] = []
        while True:
            number = int(np.argmax(best))
            if best[number] < THRESHOLD:
                return found
            onset, stay = number * self._stride - before, int(self._stays[which[number]])
            found.append((float(onset), stay / self._rate_hz))
            reach = round(self._rate_hz)
            first, last = onset - reach - int(self._stays[-1]), min(onset + stay + reach, count)
            for other in range(max((first + before) // self._stride, 0), (last + before) // self._stride + 1):
                if other < len(best):
                    end = other * self._stride - before + int(self._stays[which[other]])
                    if end > onset - reach:
                        best[other] = -1.0

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
        power, x, y, z = fit_trapezoid(*self._arguments(residual, onset, stay_s))
        if power <= 0.0:
            return _Fit(onset, stay_s, np.zeros(3), 0.0)
        size = np.array([x, y, z]) / power
        return _Fit(onset, stay_s, size, float(size @ size) * power)

    def _add(self, innovations: Innovations, onset: float, stay_s: float, size: Floats) -> None:
        add_trapezoid(*self._arguments(innovations, onset, stay_s), size)

    def _arguments(
        self, innovations: Innovations, onset: float, stay_s: float
    ) -> tuple[Floats, Bools, Floats, Floats, float, float, float, int, float]:
        """What the compiled functions need: the filter; onset, stay, ramp and tail in samples; and the correlation."""
        rate_hz = self._rate_hz
        return (
            innovations.values,
            innovations.valid,
            innovations.gain,
            innovations.deviation_m,
            onset,
            stay_s * rate_hz,
            RAMP_S * rate_hz,
            round(_TAIL_S * rate_hz),
            self._correlation,
        )

    def _event(self, station: str, valid: Bools, fit: "_Fit") -> ExcursionEvent:
        length_m = float(np.sqrt(fit.size @ fit.size))
        variance_m2 = length_m**2 / max(fit.score, 1e-9)  # of one axis
        end = fit.onset + (fit.stay_s + 2.0 * RAMP_S) * self._rate_hz
        whole = fit.onset >= _EDGE_S * self._rate_hz and end < len(valid)
        size_m = float(np.sqrt(max(length_m**2 - 2.0 * variance_m2, 0.0)))
        timed = all(self._is_seen(valid, edge) for edge in (fit.onset, fit.onset + fit.stay_s * self._rate_hz))
        return ExcursionEvent(station, fit.onset / self._rate_hz, fit.stay_s, size_m, fit.score, whole, timed)

    def _is_seen(self, valid: Bools, edge: float) -> bool:
        """Whether most samples around a rise or a return that begins at this sample count."""
        ramp = RAMP_S * self._rate_hz
        first, last = int(edge - 0.5 * ramp), int(edge + 1.5 * ramp) + 1
        return first >= 0 and last <= len(valid) and bool(valid[first:last].mean() > _SEEN)


def _onset(fit: _Fit) -> float:
    return fit.onset


@compiled
def rise_power(valid: Bools, gain: Floats, deviation: Floats, ramp: float, horizon: int, correlation: float) -> Floats:
    """(N,) power of the innovations of a rise of unit height that begins at each sample, within `horizon` samples."""
    count = len(valid)
    out = np.zeros(count)
    for onset in range(count):
        state = 0.0
        for i in range(onset, min(onset + horizon, count)):
            state *= correlation
            if valid[i]:
                innovation = min((i - onset) / ramp, 1.0) - state
                state += gain[i] * innovation
                out[onset] += (innovation / deviation[i]) ** 2
    return out


@compiled
def rise_products(place: Floats, ramp: float) -> tuple[Floats, int]:
    """Products (K, 3) of the transposed innovations (N, 3) with a rise at each sample, and how many begin before 0."""
    count, before = len(place), int(np.ceil(ramp))
    out = np.zeros((count + before, 3))
    total = np.zeros(3)  # of all samples after the ramp
    for back in range(count + before):
        onset = count - 1 - back
        reached = onset + before
        if 0 <= reached < count:
            for a in range(3):
                total[a] += place[reached, a]
        for a in range(3):
            out[onset + before, a] = total[a]
        for i in range(max(onset, 0), min(reached, count)):
            for a in range(3):
                out[onset + before, a] += place[i, a] * (i - onset) / ramp
    return out, before


@compiled
def search_durations(
    products: Floats, before: int, rise: Floats, stays: Ints, power: Floats, edge_power: float, stride: int
) -> tuple[Floats, Ints]:
    """The best score of an excursion that begins at each `stride`th sample, and the number of its duration (K,).

    `rise` is the power of a rise at each sample, `power` that of the durations without gaps, `edge_power` that of a
    rise without gaps. An excursion whose rise or return falls into a gap has the less power.
    """
    count = len(products)
    places = (count + stride - 1) // stride
    best, which = np.full(places, -1.0), np.zeros(places, dtype=np.int64)
    for place in range(places):
        k = place * stride
        begins = rise[max(k - before, 0)] - edge_power
        for number in range(len(stays)):
            end = k + stays[number]
            x, y, z = products[k, 0], products[k, 1], products[k, 2]
            ends = -edge_power
            if end < count:
                x -= products[end, 0]
                y -= products[end, 1]
                z -= products[end, 2]
                if end >= before:
                    ends = rise[end - before] - edge_power
            total = max(power[number] + begins + ends, 0.3 * power[number])
            score = (x * x + y * y + z * z) / total
            if score > best[place]:
                best[place], which[place] = score, number
    return best, which


@compiled
def fit_trapezoid(
    values: Floats,
    valid: Bools,
    gain: Floats,
    deviation: Floats,
    onset: float,
    stay: float,
    ramp: float,
    tail: int,
    correlation: float,
) -> tuple[float, float, float, float]:
    """Power of an excursion's innovations, and their products with innovations (N, 3); times are in samples."""
    first = max(int(np.floor(onset)), 0)
    last = min(int(np.floor(onset)) + int(np.ceil(stay + ramp)) + tail + 1, len(valid))
    power, x, y, z, state = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(first, last):
        state *= correlation
        if valid[i]:
            innovation = max(min(min(i - onset, onset + stay + ramp - i) / ramp, 1.0), 0.0) - state
            state += gain[i] * innovation
            innovation /= deviation[i]
            power += innovation * innovation
            x += innovation * values[i, 0]
            y += innovation * values[i, 1]
            z += innovation * values[i, 2]
    return power, x, y, z


@compiled
def add_trapezoid(
    values: Floats,
    valid: Bools,
    gain: Floats,
    deviation: Floats,
    onset: float,
    stay: float,
    ramp: float,
    tail: int,
    correlation: float,
    size: Floats,
) -> None:
    """Add an excursion of size (3,) to innovations (N, 3) in place; see `fit_trapezoid`."""
    first = max(int(np.floor(onset)), 0)
    last = min(int(np.floor(onset)) + int(np.ceil(stay + ramp)) + tail + 1, len(valid))
    state = 0.0
    for i in range(first, last):
        state *= correlation
        if valid[i]:
            innovation = max(min(min(i - onset, onset + stay + ramp - i) / ramp, 1.0), 0.0) - state
            state += gain[i] * innovation
            for axis in range(3):
                values[i, axis] += innovation / deviation[i] * size[axis]
