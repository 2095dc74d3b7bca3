"""Echo bursts against the simulation's own record of them."""

import numpy as np
import pytest

from harness.core.arrays import Bools
from harness.measure.echoes import EchoBursts, echo_limit_m, find_echoes, hold
from harness.measure.static_series import StaticSeries
from harness.simulate.components.transient import Echo
from tests.measure.resting import RATE_HZ, default_noise, rest_series
from tests.measure.static_readings import simulate_static


def found_and_true(share: float, seed: int) -> tuple[StaticSeries, EchoBursts, Bools]:
    noise = default_noise(echo=Echo(share=share))
    readings = simulate_static(noise, seed, rate_hz=RATE_HZ, seconds=300.0, stations=("one",))
    series = rest_series(readings)[0]
    return series, find_echoes(series, 0.025), readings.affected["echo"][: len(series), 0] & series.valid


@pytest.mark.parametrize("share", [0.03, 0.09])
def test_nearly_every_echo_is_found_and_nothing_else(share: float) -> None:
    for seed in (1001, 1002, 1003):
        series, bursts, true = found_and_true(share, seed)
        found = bursts.mask(len(series))
        assert np.sum(found & ~true) <= 2
        assert np.sum(true & ~found) <= 0.04 * true.sum()


def test_adjacent_bursts_are_parted_and_sizes_are_right() -> None:
    rng = np.random.default_rng(1)
    position_m = 0.001 * rng.normal(size=(400, 3))
    position_m[100:103] += [0.1, 0.0, 0.0]
    position_m[103:105] += [0.0, -0.2, 0.0]
    position_m[200] += [0.0, 0.0, 0.06]
    position_m[0] += [0.3, 0.0, 0.0]
    series = StaticSeries("one", 40.0, 0.0, 0.0, position_m, np.zeros((400, 3)), np.ones(400), np.ones(400, bool))
    bursts = find_echoes(series, 0.025)
    assert bursts.begin.tolist() == [0, 100, 103, 200]
    assert bursts.end.tolist() == [1, 103, 105, 201]
    assert bursts.whole.tolist() == [False, True, True, True]
    np.testing.assert_allclose(bursts.size_m, [0.3, 0.1, 0.2, 0.06], atol=0.003)


def test_an_excursion_is_no_echo() -> None:
    ramp = np.clip(np.arange(400) / 8.0 - 12.0, 0.0, 1.0) * np.clip(30.0 - np.arange(400) / 8.0, 0.0, 1.0)
    position_m = 0.03 * ramp[:, None] * np.array([1.0, 0.0, 0.0])
    series = StaticSeries("one", 40.0, 0.0, 0.0, position_m, np.zeros((400, 3)), np.ones(400), np.ones(400, bool))
    assert len(find_echoes(series, 0.025).begin) == 0


def test_the_limit_rises_with_the_noise() -> None:
    assert echo_limit_m(0.00075, 0.0015, 1.0) == 0.025
    assert echo_limit_m(0.01, 0.0, 1.0) == pytest.approx(0.08)
    assert echo_limit_m(0.0, 0.01, 0.1) == pytest.approx(0.08)


def test_missing_rows_hold_the_last_valid_one() -> None:
    values = np.arange(5.0)[:, None]
    valid = np.array([False, True, False, True, False])
    assert hold(values, valid)[:, 0].tolist() == [1.0, 1.0, 1.0, 3.0, 3.0]
