"""Power spectral density of a position error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, find_runs, freeze
from harness.errors import BadInput


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
