"""Distances at rest by hand; the slope of the mean against dense generalised least squares, and its coverage."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Bools, Floats
from harness.core.number_format import Interval
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.noise_fit import NoiseFit
from harness.measure.rest_statistics import drift_speed, mean_drift, rest_distance
from harness.measure.static_series import StaticSeries
from harness.simulate import Noise
from tests.measure.test_gauss_markov import dense_covariance
from tests.measure.test_noise_fit import PRESET, nothing, series_and_masks, truth

KNOWN = NoiseFit({key: Interval(value, value, value) for key, value in truth(PRESET).items()}, {})


def at_distances(distance: Floats, valid: Bools) -> StaticSeries:
    """A station at these distances [m] and twice these angles [rad] from its resting pose, 4 readings a second."""
    rows = len(distance)
    place = distance[:, None] * [0.6, 0.0, -0.8]
    return StaticSeries("head", 4.0, 0.0, 0.0, place, -2.0 * place, np.ones(rows), valid)


def test_the_distance_of_half_the_readings_with_the_interval_of_its_blocks() -> None:
    """Blocks of 10 s with 3/4, 3/4, 1/4 and 1/4 of their readings below: a standard error of 0.144, t of 3.18."""
    distance = np.concatenate([np.arange(1, 41), np.arange(1, 41), np.arange(21, 61), np.arange(21, 61), [900] * 39])
    valid = np.ones(199, bool)
    found = rest_distance([at_distances(0.01 * distance, valid)], "position_m", 0.5)
    assert found.value == pytest.approx(0.30, abs=0.006)
    assert (found.low, found.high) == pytest.approx((0.032, 0.568), abs=0.01)
    assert found.count == 160
    turned = rest_distance([at_distances(0.01 * distance, valid)], "rotation_rad", 0.5)
    assert (turned.value, turned.high) == pytest.approx((2.0 * found.value, 2.0 * found.high))
    distance[5:10], valid[5:10] = 900, False
    assert rest_distance([at_distances(0.01 * distance, valid)], "position_m", 0.5).count == 155
    assert not rest_distance([at_distances(distance[:159], valid[:159])], "position_m", 0.5).is_measured


def test_outliers_do_not_change_the_distance_of_the_others(rng: np.random.Generator) -> None:
    """Two percent of the readings are 40 times as far as 95 % of the others, as with echoes."""
    plain = np.abs(rng.normal(scale=1e-3, size=4000))
    echoes = np.where(np.arange(4000) % 50 == 7, 0.08, plain)
    half, most = (
        [rest_distance([at_distances(each, np.ones(4000, bool))], "position_m", share) for each in (plain, echoes)]
        for share in (0.5, 0.95)
    )
    assert half[1].value == pytest.approx(half[0].value, rel=0.04)
    assert most[1].value == pytest.approx(most[0].value, rel=0.15)
    assert most[0].value == pytest.approx(1.96e-3, rel=0.1)
    assert most[0].contains(1.96e-3)


def test_the_slope_is_that_of_dense_least_squares() -> None:
    series, _ = series_and_masks(PRESET, 1, 15.0, ("one", "two"))
    left_out = nothing(series)
    left_out[0][200:260] = True
    found = mean_drift(series, left_out, KNOWN, "position_m")
    rows, columns, blocks = [], [], []
    for number, (one, mask) in enumerate(zip(series, left_out, strict=True)):
        design = np.zeros((int((~mask).sum()), 3))
        design[:, number], design[:, 2] = 1.0, np.flatnonzero(~mask) / 40.0
        weight = np.linalg.inv(dense_covariance(~mask, 40.0, 0.00075, 0.0015, 1.0))
        rows.append(design.T @ weight @ design)
        columns.append(design.T @ weight @ one.position_m[~mask])
        blocks.append(len(design))
    covariance = np.linalg.inv(sum(rows))
    expected = (covariance @ sum(columns))[2]
    np.testing.assert_allclose([one.value for one in found], expected, rtol=1e-9)
    np.testing.assert_allclose([one.high - one.value for one in found], 1.959964 * np.sqrt(covariance[2, 2]), rtol=1e-6)
    assert found[0].count == sum(blocks)


def test_the_velocity_of_a_station_that_creeps_is_found() -> None:
    series, _ = series_and_masks(PRESET, 2, 300.0, ("one",))
    creep = np.arange(12_000)[:, None] / 40.0 * np.array([2e-5, 0.0, -4e-5])
    moved = [replace(series[0], position_m=series[0].position_m + creep)]
    still, found = (mean_drift(one, nothing(series), KNOWN, "position_m") for one in (series, moved))
    assert all(abs(one.value) < 5e-6 for one in still)
    np.testing.assert_allclose([f.value - s.value for f, s in zip(found, still, strict=True)], creep[40], atol=1e-12)
    assert not found[2].contains(0.0)


def test_without_noise_or_readings_nothing_is_measured() -> None:
    series, _ = series_and_masks(PRESET, 3, 10.0, ("one",))
    quiet = NoiseFit(dict.fromkeys(NOISE_KEYS, Interval.missing("none")), {})
    assert not any(one.is_measured for one in mean_drift(series, nothing(series), quiet, "position_m"))
    assert not any(one.is_measured for one in mean_drift(series, [np.ones(400, bool)], KNOWN, "rotation_rad"))


@pytest.mark.long
@pytest.mark.parametrize("name", ["position_m", "rotation_rad"])
def test_intervals_contain_no_drift(name: str) -> None:
    noise: Noise = PRESET
    inside = np.zeros(3)
    for seed in range(50):
        series, _ = series_and_masks(noise, 500 + seed, 60.0, ("one",))
        inside += [one.contains(0.0) for one in mean_drift(series, nothing(series), KNOWN, name)]
    assert np.all(inside >= 43), inside


def test_the_speed_of_a_station_without_drift_is_compatible_with_zero() -> None:
    rng = np.random.default_rng(1)
    compatible = 0
    for _ in range(500):
        velocity = [Interval.normal(float(value), 1.0) for value in rng.normal(size=3)]
        compatible += drift_speed(velocity).low == 0.0
    assert 0.92 <= compatible / 500 <= 0.98
    assert drift_speed([Interval.normal(value, 0.1) for value in (3.0, 0.0, 4.0)]).value == pytest.approx(5.0)
    assert not drift_speed([Interval.missing("why")] * 3).is_measured
