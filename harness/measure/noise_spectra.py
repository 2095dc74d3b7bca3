"""Allan deviation and power spectral density of readings at rest, pooled over series, and those of the noise model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, find_runs, freeze
from harness.core.compiled import compiled
from harness.errors import BadInput

_LEAST_SHARE = 0.75
"""Least share of an average's readings that must be there."""


@dataclass(frozen=True, eq=False)
class AllanDeviation:
    """Allan deviation of a signal at K averaging times, all its axes together."""

    tau_s: Floats
    """(K,) averaging times, doubling from one period [s]."""
    squares: Floats
    """(K,) sums of the squared differences of consecutive averages, in the unit of the signal squared."""
    pairs: Ints
    """(K,) number of these differences over all axes; 0 beyond the length of the signal."""
    freedom: Floats
    """(K,) equivalent degrees of freedom of the sums."""

    def __post_init__(self) -> None:
        freeze(self, tau_s=("K",), squares=("K",), freedom=("K",))
        freeze(self, np.int64, pairs=(len(self.tau_s),))

    @property
    def deviation(self) -> Floats:
        """(K,) Allan deviation, in the unit of the signal; NaN without a pair."""
        out: Floats = np.sqrt(self.squares / np.where(self.pairs > 0, 2.0 * self.pairs, np.nan))
        return out

    @property
    def interval(self) -> Floats:
        """(K, 2) ends of the 95 % interval of the deviation, by the chi-squared distribution; NaN without a pair."""
        from scipy.special import chdtri

        freedom = np.where(self.pairs > 0, self.freedom, np.nan)
        low, high = (np.sqrt(freedom / chdtri(freedom, tail)) for tail in (0.025, 0.975))
        return np.stack([self.deviation * low, self.deviation * high], axis=1)


def measure_allan(values: Floats, used: Bools, rate_hz: float, *, longest_s: float = 300.0) -> AllanDeviation:
    """Allan deviation of a signal (N, A) over the used rows (N,), up to `longest_s`.

    All pairs of adjacent averages of equal length count, overlapping ones too (Howe, Allan and Barnes 1981). An average
    needs three quarters of its readings. Degrees of freedom are the smaller of those for white and for random-walk
    noise (NIST Special Publication 1065, table 5), so intervals are rather too wide. BadInput for a rate that is not
    above zero.
    """
    if not 0.0 < rate_hz < np.inf or not longest_s >= 1.0 / rate_hz:
        raise BadInput(f"An Allan deviation at {rate_hz:g} Hz up to {longest_s:g} s.", "Both must be above a period.")
    lengths = 2 ** np.arange(int(np.log2(longest_s * rate_hz) + 1e-9) + 1)
    axes = values.shape[1]
    clean = np.ascontiguousarray(np.where(used[:, None], values, 0.0))
    squares, pairs, freedom = np.zeros(len(lengths)), np.zeros(len(lengths), np.int64), np.zeros(len(lengths))
    for k, length in enumerate(lengths.tolist()):
        total, number = _sum_squares(clean, np.ascontiguousarray(used), length, _LEAST_SHARE)
        whole = len(values) - 2 * length + 1
        if number:
            squares[k], pairs[k] = total, number * axes
            freedom[k] = axes * max(equivalent_freedom(len(values) + 1, length) * number / whole, 0.5)
    return AllanDeviation(lengths / rate_hz, squares, pairs, freedom)


def pool_allan(parts: Sequence[AllanDeviation]) -> AllanDeviation:
    """The deviation over several independent signals at the same averaging times; BadInput if these differ by 1 %."""
    if not parts or any(
        len(part.tau_s) != len(parts[0].tau_s) or not np.allclose(part.tau_s, parts[0].tau_s, rtol=0.01)
        for part in parts
    ):
        raise BadInput("Allan deviations at different averaging times cannot be pooled.", "Use one rate and length.")
    squares, pairs, freedom = (
        np.sum([getattr(part, name) for part in parts], axis=0) for name in ("squares", "pairs", "freedom")
    )
    return AllanDeviation(parts[0].tau_s, squares, pairs, freedom)


def expected_allan(tau_s: Floats, rate_hz: float, white: float, drift: float, correlation_s: float) -> Floats:
    """Allan deviation (K,) of white noise and Gauss-Markov drift, for averages of whole numbers of records.

    The variance is that of averages of a first-order autoregressive sequence, in closed form.
    """
    count = np.rint(tau_s * rate_hz)
    phi = np.exp(-1.0 / (rate_hz * correlation_s))
    rise = 1.0 - phi**count
    # Sums of phi^|i - j| over one block and over two adjacent blocks.
    own = count * (1.0 + phi) / (1.0 - phi) - 2.0 * phi * rise / (1.0 - phi) ** 2
    across = phi * rise**2 / (1.0 - phi) ** 2
    variance = white**2 / count + drift**2 * (own - across) / count**2
    out: Floats = np.sqrt(variance)
    return out


def equivalent_freedom(count: int, length: int) -> float:
    """Degrees of freedom of an overlapping Allan variance over `count` phases and averages of `length` readings.

    The smaller of the values for white frequency noise and for random-walk frequency noise, at least 1.
    """
    n, m = float(count), float(length)
    white = (3.0 * (n - 1.0) / (2.0 * m) - 2.0 * (n - 2.0) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0)
    walk = (n - 2.0) / m * ((n - 1.0) ** 2 - 3.0 * m * (n - 1.0) + 4.0 * m**2) / (n - 3.0) ** 2 if n > 3.0 else 1.0
    return max(min(white, walk), 1.0)


@compiled
def _sum_squares(values: Floats, used: Bools, length: int, least: float) -> tuple[float, int]:
    """Sum over axes of squared differences of adjacent averages, and the number of pairs; unused values must be 0."""
    rows, axes = values.shape
    total, number = 0.0, 0
    if rows < 2 * length:
        return total, number
    first, second = np.zeros(axes), np.zeros(axes)
    first_count, second_count = 0, 0
    for row in range(length):
        for axis in range(axes):
            first[axis] += values[row, axis]
            second[axis] += values[row + length, axis]
        first_count += used[row]
        second_count += used[row + length]
    start = 0
    while True:
        if first_count >= least * length and second_count >= least * length and first_count and second_count:
            for axis in range(axes):
                step = second[axis] / second_count - first[axis] / first_count
                total += step * step
            number += 1
        if start + 2 * length >= rows:
            break
        for axis in range(axes):
            first[axis] += values[start + length, axis] - values[start, axis]
            second[axis] += values[start + 2 * length, axis] - values[start + length, axis]
        first_count += int(used[start + length]) - int(used[start])
        second_count += int(used[start + 2 * length]) - int(used[start + length])
        start += 1
    return total, number


@dataclass(frozen=True, eq=False)
class ErrorSpectrum:
    """One-sided power spectral density of a position error, summed over its axes.

    The integral over frequency is the variance of the error within a segment.
    """

    frequency_hz: Floats
    """(F,) frequencies, from the inverse of a segment's length to half the sampling rate [Hz]."""
    density_m2_hz: Floats
    """(F,) density [m^2/Hz]; NaN without any segment."""
    segments: int
    """Number of segments that were averaged."""

    def __post_init__(self) -> None:
        freeze(self, frequency_hz=("F",), density_m2_hz=("F",))


def measure_spectrum(error_m: Floats, rate_hz: float, *, segment_s: float = 10.0) -> ErrorSpectrum:
    """Estimate the spectrum of an error (T, A) with A axes, sampled at `rate_hz`, by Welch's method.

    Segments of `segment_s` overlap by half and have a Hann window; the mean of each segment is subtracted (Welch 1967,
    IEEE Trans. Audio Electroacoust. 15). A segment with a NaN is left out. BadInput for a rate that is not above zero
    or a segment of fewer than four samples.
    """
    count = round(segment_s * rate_hz) if 0.0 < rate_hz < np.inf and 0.0 < segment_s < np.inf else 0
    if count < 4:
        raise BadInput(
            f"A segment of {segment_s:g} s at {rate_hz:g} Hz has fewer than four samples.",
            "Choose longer segments.",
        )
    from scipy import signal  # takes half a second to load, and few commands need it

    frequency_hz: Floats = np.arange(0.0, count // 2 + 1) * (rate_hz / count)
    total: Floats = np.zeros(len(frequency_hz))
    segments = 0
    for start, end in find_runs(np.asarray(np.isfinite(error_m).all(axis=1))):
        if end - start >= count:
            number = 1 + (end - start - count) // (count - count // 2)
            _, density_m2_hz = signal.welch(error_m[start:end], rate_hz, "hann", count, count // 2, axis=0)
            total += number * density_m2_hz.sum(axis=1)
            segments += int(number)
    mean: Floats = total / segments if segments else np.full(len(total), np.nan)
    return ErrorSpectrum(frequency_hz[1:], mean[1:], segments)


def pool_spectra(spectra: Sequence[ErrorSpectrum]) -> ErrorSpectrum:
    """The mean of spectra over the same frequencies, weighted by their segments; BadInput if the frequencies differ."""
    if not spectra or any(not np.array_equal(s.frequency_hz, spectra[0].frequency_hz) for s in spectra):
        raise BadInput("Spectra over different frequencies cannot be pooled.", "Use one rate and one segment length.")
    measured, segments = [s for s in spectra if s.segments], sum(s.segments for s in spectra)
    total = np.sum([s.segments * s.density_m2_hz for s in measured], axis=0)
    density = total / segments if segments else spectra[0].density_m2_hz
    return ErrorSpectrum(spectra[0].frequency_hz, density, segments)
