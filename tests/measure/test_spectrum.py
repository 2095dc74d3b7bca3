"""The spectrum against a plain transform of segments, against known signals, and its refusals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import BadInput, ShapeError
from harness.measure.spectrum import ErrorSpectrum, measure_spectrum, pool_spectra


def plain_spectrum(error_m: Floats, rate_hz: float, count: int) -> tuple[Floats, int]:
    """Density of Welch's method by sums over samples; segments of every stretch without a NaN start at its start."""
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(count) / count)
    total, segments, start = np.zeros(count // 2 + 1), 0, 0
    while start + count <= len(error_m):
        part = error_m[start : start + count]
        bad = np.flatnonzero(np.isnan(part).any(axis=1))
        if len(bad):
            start += int(bad[-1]) + 1  # the next stretch begins after the last unknown sample of this one
            continue
        segments += 1
        part = (part - part.mean(axis=0)) * window[:, None]
        for k in range(count // 2 + 1):
            turn = np.exp(-2j * np.pi * k * np.arange(count) / count)
            sides = 1.0 if k == 0 or 2 * k == count else 2.0
            total[k] += sides * sum(abs(np.sum(turn * axis)) ** 2 for axis in part.T) / (rate_hz * np.sum(window**2))
        start += count - count // 2
    return total[1:] / max(segments, 1), segments


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 90), st.integers(4, 21), st.floats(1.0, 200.0), st.floats(0.0, 0.05))
def test_the_density_is_that_of_a_plain_transform(
    seed: int, samples: int, count: int, rate_hz: float, unknown: float
) -> None:
    rng = np.random.default_rng(seed)
    error_m = rng.normal(size=(samples, 3))
    error_m[rng.uniform(size=samples) < unknown, 1] = np.nan
    found = measure_spectrum(error_m, rate_hz, segment_s=count / rate_hz)
    density, segments = plain_spectrum(error_m, rate_hz, count)
    assert found.segments == segments
    np.testing.assert_allclose(found.frequency_hz, rate_hz * np.arange(1, count // 2 + 1) / count)
    np.testing.assert_allclose(found.density_m2_hz, density if segments else np.full(count // 2, np.nan), atol=1e-12)


def test_white_noise_has_a_flat_spectrum_with_its_variance_below_it() -> None:
    error_m = 0.002 * generator(1, "spectrum").normal(size=(40_000, 3))
    found = measure_spectrum(error_m, 40.0)
    step_hz = found.frequency_hz[1] - found.frequency_hz[0]
    assert step_hz == pytest.approx(0.1)
    assert np.sum(found.density_m2_hz) * step_hz == pytest.approx(3.0 * 0.002**2, rel=0.02)
    level = 3.0 * 0.002**2 / 20.0
    assert np.median(found.density_m2_hz) == pytest.approx(level, rel=0.03)


def test_a_sine_stands_at_its_frequency_with_half_its_squared_amplitude() -> None:
    time_s = np.arange(4000) / 40.0
    error_m = np.zeros((4000, 3))
    error_m[:, 2] = 0.01 * np.sin(2.0 * np.pi * 2.0 * time_s) + 0.5
    found = measure_spectrum(error_m, 40.0)
    assert found.frequency_hz[np.argmax(found.density_m2_hz)] == pytest.approx(2.0)
    assert np.sum(found.density_m2_hz) * 0.1 == pytest.approx(0.5 * 0.01**2, rel=1e-6)


def test_without_a_whole_segment_there_is_no_density() -> None:
    error_m = np.zeros((80, 3))
    error_m[40] = np.nan
    found = measure_spectrum(error_m, 40.0, segment_s=1.5)
    assert found.segments == 0
    assert np.isnan(found.density_m2_hz).all()


def test_pooled_spectra_weigh_by_their_segments() -> None:
    frequency_hz = np.array([1.0, 2.0])
    one, three = ErrorSpectrum(frequency_hz, np.array([4.0, 0.0]), 1), ErrorSpectrum(frequency_hz, np.zeros(2), 3)
    none = ErrorSpectrum(frequency_hz, np.full(2, np.nan), 0)
    pooled = pool_spectra([none, one, three])
    assert pooled.density_m2_hz.tolist() == [1.0, 0.0]
    assert pooled.segments == 4
    assert np.isnan(pool_spectra([none, none]).density_m2_hz).all()


def test_spectra_over_different_frequencies_are_refused() -> None:
    a, b = (measure_spectrum(np.zeros((80, 1)), 40.0, segment_s=length_s) for length_s in (1.0, 2.0))
    for spectra in ([a, b], []):
        with pytest.raises(BadInput, match="pooled"):
            pool_spectra(spectra)


@pytest.mark.parametrize(
    ("rate_hz", "segment_s"), [(0.0, 1.0), (-40.0, 1.0), (float("nan"), 1.0), (40.0, 0.05), (40.0, float("inf"))]
)
def test_a_segment_of_too_few_samples_is_refused(rate_hz: float, segment_s: float) -> None:
    with pytest.raises(BadInput, match="four samples"):
        measure_spectrum(np.zeros((80, 3)), rate_hz, segment_s=segment_s)


def test_records_are_immutable_and_their_arrays_agree() -> None:
    found = measure_spectrum(np.zeros((80, 1)), 40.0, segment_s=1.0)
    with pytest.raises(ValueError, match="read-only"):
        found.density_m2_hz[0] = 1.0
    with pytest.raises(ShapeError):
        replace(found, density_m2_hz=np.zeros(3))
