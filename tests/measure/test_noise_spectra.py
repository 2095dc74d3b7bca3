"""Allan deviation and spectrum against other programs, closed forms and plain sums, with gaps; coverage; refusals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import BadInput, ShapeError
from harness.measure.noise_spectra import (
    AllanDeviation,
    ErrorSpectrum,
    equivalent_freedom,
    expected_allan,
    measure_allan,
    measure_spectrum,
    pool_allan,
    pool_spectra,
)
from harness.simulate import gauss_markov


def noise(seed: int, count: int, axes: int, white: float, drift: float, correlation_s: float) -> np.ndarray:
    rng = generator(seed, "allan")
    wander = gauss_markov(rng.normal(size=(count, axes)), float(np.exp(-1.0 / (40.0 * correlation_s))))
    return drift * wander + white * rng.normal(size=(count, axes))


def test_without_gaps_it_is_that_of_allantools() -> None:
    allantools = pytest.importorskip("allantools")
    values = noise(1, 3001, 1, 0.75, 1.5, 1.0)
    found = measure_allan(values, np.ones(3001, bool), 40.0, longest_s=30.0)
    tau_s, deviation, _, pairs = allantools.oadev(values[:, 0], rate=40.0, data_type="freq", taus=found.tau_s)
    assert found.tau_s.tolist() == (2.0 ** np.arange(11) / 40.0).tolist()
    np.testing.assert_allclose(tau_s, found.tau_s)
    np.testing.assert_allclose(found.deviation, deviation, rtol=1e-9)
    np.testing.assert_array_equal(found.pairs, pairs)


@pytest.mark.parametrize("length", [1, 4, 64, 500])
def test_degrees_of_freedom_are_the_smaller_of_two_of_allantools(length: int) -> None:
    allantools = pytest.importorskip("allantools")
    both = [allantools.edf_simple(3002, length, alpha) for alpha in (0, -2)]
    assert equivalent_freedom(3002, length) == pytest.approx(max(min(both), 1.0), rel=1e-9)


def test_gaps_change_nothing_but_the_number_of_pairs() -> None:
    values = noise(2, 40_000, 3, 0.75, 1.5, 1.0)
    used = generator(2, "gaps").uniform(size=40_000) > 0.1
    used[5000:9000] = False
    holed = np.where(used[:, None], values, np.nan)
    whole, found = (measure_allan(v, u, 40.0, longest_s=60.0) for v, u in ((values, used | True), (holed, used)))
    assert np.all(found.pairs < whole.pairs)
    assert np.all(found.freedom < whole.freedom)
    np.testing.assert_allclose(found.deviation[:9], whole.deviation[:9], rtol=0.04)
    assert np.max(np.abs(found.deviation / expected_allan(found.tau_s, 40.0, 0.75, 1.5, 1.0) - 1.0)[:8]) < 0.1


def test_an_average_needs_three_quarters_of_its_readings() -> None:
    values = np.array([[0.0], [0.0], [0.0], [0.0], [1.0], [5.0], [1.0], [1.0]])
    used = np.array([True, True, True, True, True, False, True, True])
    found = measure_allan(values, used, 1.0, longest_s=4.0)
    assert found.pairs.tolist() == [5, 2, 1]
    assert found.squares.tolist() == [1.0, 0.25, 1.0]
    used[4] = False
    assert measure_allan(values, used, 1.0, longest_s=4.0).pairs.tolist() == [4, 1, 0]


def test_the_closed_form_is_that_of_a_plain_double_sum() -> None:
    phi = np.exp(-1.0 / 40.0)
    for count in (1, 2, 7, 64):
        weight = np.concatenate([np.full(count, -1.0), np.ones(count)]) / count
        apart = np.abs(np.arange(2 * count)[:, None] - np.arange(2 * count))
        variance = 0.5 * weight @ (1.5**2 * phi**apart + 0.75**2 * np.eye(2 * count)) @ weight
        found = expected_allan(np.array([count / 40.0]), 40.0, 0.75, 1.5, 1.0)
        assert found[0] == pytest.approx(np.sqrt(variance), rel=1e-9)


@pytest.mark.long
def test_intervals_contain_the_closed_form() -> None:
    rounds = 80
    inside = np.zeros(12)
    for seed in range(rounds):
        found = measure_allan(noise(seed, 12_000, 3, 0.75, 1.5, 1.0), np.ones(12_000, bool), 40.0, longest_s=60.0)
        truth = expected_allan(found.tau_s, 40.0, 0.75, 1.5, 1.0)
        inside += (found.interval[:, 0] <= truth) & (truth <= found.interval[:, 1])
    assert np.all(inside >= 0.9 * rounds), inside


def test_pooled_deviations_weigh_by_their_pairs() -> None:
    one = AllanDeviation(np.array([1.0, 2.0]), np.array([8.0, 4.0]), np.array([4, 2]), np.array([3.0, 1.0]))
    other = replace(one, squares=np.array([0.0, 0.0]), pairs=np.array([12, 0]), freedom=np.array([9.0, 0.0]))
    pooled = pool_allan([one, other])
    assert pooled.deviation.tolist() == [0.5, 1.0]
    assert pooled.freedom.tolist() == [12.0, 1.0]
    assert np.isnan(pool_allan([replace(one, pairs=np.array([4, 0]))]).interval[1]).all()
    for parts in ([], [one, replace(one, tau_s=np.array([1.0, 2.1]))]):
        with pytest.raises(BadInput, match="pooled"):
            pool_allan(parts)


@pytest.mark.parametrize(("rate_hz", "longest_s"), [(0.0, 1.0), (float("nan"), 1.0), (40.0, 0.01)])
def test_rates_and_lengths_that_cannot_be_are_refused(rate_hz: float, longest_s: float) -> None:
    with pytest.raises(BadInput, match="above a period"):
        measure_allan(np.zeros((10, 1)), np.ones(10, bool), rate_hz, longest_s=longest_s)


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
