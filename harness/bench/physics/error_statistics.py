"""Position errors of the physical simulation beside those of `noise = "default"`, on the same motion, for the page."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from harness.bench import common
from harness.bench.physics.scenes import simulate_performer
from harness.bench.physics.speed import PHYSICAL
from harness.core.arrays import Floats, Ints
from harness.core.number_format import count_noun
from harness.core.progress import ProgressCallback
from harness.errors import BadInput
from harness.measure import Episodes, ErrorSpectrum, find_excursions, find_gaps, measure_spectrum, pool_spectra
from harness.report.physics.error_comparison import ERROR_QUANTILES, TrackerErrorStatistics
from harness.simulate import Noise, TrackerConfig, noise_preset

LIMIT_M, MERGE_S, SEGMENT_S = 0.01, 0.5, 10.0
"""Errors beyond this are excursions [m]; excursions less than this apart are one [s]; segment of a spectrum [s]."""
_CLASSES = 10
"""Classes of quality."""
_SECONDS = 60.0


@dataclass(frozen=True, eq=False)
class RecordedErrors:
    """The errors of S stations at E sampled frames of one simulated recording."""

    time_s: Floats
    """(E,) sampling times at equal intervals [s]."""
    error_m: Floats
    """(E, S, 3) reported minus true position of each station [m]."""
    quality: Floats
    """(E, S) reported quality, 0 lost to 1 best."""


def error_statistics(
    label: str,
    source: str,
    recordings: Iterable[RecordedErrors],
    *,
    limit_m: float = LIMIT_M,
    merge_s: float = MERGE_S,
    segment_s: float = SEGMENT_S,
) -> TrackerErrorStatistics:
    """Pool the errors of recordings and stations into the statistics of one error model.

    A reading of quality 0 has no error: it ends an excursion, and no segment of the spectrum contains it. BadInput
    without any recording, or if sampling intervals differ within a recording or between recordings.
    """
    spectra: list[ErrorSpectrum] = []
    excursions: list[Episodes] = []
    gaps: list[Episodes] = []
    sizes: list[Floats] = []
    qualities: list[Floats] = []
    station_s, count, rate_hz = 0.0, 0, 0.0
    for recording in recordings:
        found_hz = _rate_hz(recording.time_s)
        if rate_hz and not np.isclose(found_hz, rate_hz, rtol=1e-6):
            raise BadInput(f"Recordings at {rate_hz:g} and {found_hz:g} Hz.", "Pool recordings of one rate.")
        rate_hz, count = rate_hz or found_hz, count + 1
        error_m = np.where(recording.quality[..., None] > 0.0, recording.error_m, np.nan)
        size_m = np.linalg.norm(error_m, axis=2)
        for row in range(error_m.shape[1]):
            spectra.append(measure_spectrum(error_m[:, row], rate_hz, segment_s=segment_s))
            excursions.append(find_excursions(recording.time_s, size_m[:, row], limit_m, merge_s=merge_s))
            gaps.append(find_gaps(recording.time_s, recording.quality[:, row]))
        station_s += size_m.size / rate_hz
        sizes.append(size_m.ravel())
        qualities.append(recording.quality.ravel())
    if not count:
        raise BadInput("There is no recording.", "Give at least one.")
    spectrum, all_m, classes = pool_spectra(spectra), np.concatenate(sizes), _quality_class(np.concatenate(qualities))
    return TrackerErrorStatistics(
        label=label,
        source=source,
        recordings=count,
        station_s=station_s,
        readings=len(all_m),
        frequency_hz=spectrum.frequency_hz,
        density_m2_hz=spectrum.density_m2_hz,
        segments=spectrum.segments,
        excursion_s=_pool(excursion.duration_s for excursion in excursions),
        excursion_peak_m=_pool(excursion.peak for excursion in excursions),
        gap_s=_pool(gap.duration_s for gap in gaps),
        truncated=sum(int(each.truncated.sum()) for each in (*excursions, *gaps)),
        quality_share=np.bincount(classes, minlength=_CLASSES + 1) / len(all_m),
        class_error_m=np.array([_quantiles(all_m[classes == n]) for n in range(1, _CLASSES + 1)]),
        error_m=_quantiles(all_m),
    )


def _rate_hz(time_s: Floats) -> float:
    """The rate of equal sampling intervals [Hz]; BadInput if they differ."""
    steps_s = np.diff(time_s)
    if len(steps_s) == 0 or not np.allclose(steps_s, steps_s.mean(), rtol=1e-3, atol=0.0) or steps_s[0] <= 0.0:
        raise BadInput("Sampling intervals differ, or there is none.", "Give every sampled frame, lost ones too.")
    return float(1.0 / steps_s.mean())


def _quality_class(quality: Floats) -> Ints:
    """Class of each quality: 0 for lost, else 1 to `_CLASSES`, with the upper end in the class."""
    return np.clip(np.ceil(quality * _CLASSES - 1e-9), quality > 0.0, _CLASSES).astype(np.int64)


def _quantiles(size_m: Floats) -> Floats:
    """(3,) `ERROR_QUANTILES` of the finite sizes; NaN without any."""
    finite = size_m[np.isfinite(size_m)]
    return np.quantile(finite, ERROR_QUANTILES) if len(finite) else np.full(len(ERROR_QUANTILES), np.nan)


def _pool(parts: Iterable[Floats]) -> Floats:
    return np.concatenate(list(parts))


def compare_error_models(
    seeds: Sequence[int], progress: ProgressCallback = lambda model, done, of: None
) -> tuple[TrackerErrorStatistics, ...]:
    """Statistics of both error models on built-in boxing, one take of each seed, with six stations."""
    out = []
    models = {"physics": PHYSICAL, 'noise = "default"': noise_preset("default")}
    takes = f"{count_noun(len(seeds), 'take')} of built-in boxing of {_SECONDS:.0f} s"
    source = f"{takes}, {len(common.MOUNTS)} stations at {TrackerConfig().rate_hz:g} Hz"
    for done, (label, noise) in enumerate(models.items()):
        progress(f"errors of {label}", done, len(models))
        out.append(error_statistics(label, f"{source}.", _recordings(seeds, noise)))
    progress("", len(models), len(models))
    return tuple(out)


def _recordings(seeds: Sequence[int], noise: Noise) -> Iterator[RecordedErrors]:
    for seed in seeds:
        found, true = simulate_performer("boxing", seed, _SECONDS, noise)
        yield RecordedErrors(found.time_s[:, 0], found.position_m - true.position_m, found.quality)
