"""Echo bursts against the simulation's own record of them."""

import numpy as np
import pytest

from harness.core.arrays import Bools
from harness.measure.echoes import LEAST_ECHO_M, EchoBursts, echo_limit_m, find_echoes, hold
from harness.measure.static_series import StaticSeries
from harness.simulate.components.transient import Echo
from tests.measure.resting_stations import (
    QUIET,
    RATE_HZ,
    at_rest,
    default_noise,
    planted_series,
    rest_series,
    simulate_static,
)

LIMIT_M = 0.025


def found_and_true(share: float, seed: int) -> tuple[StaticSeries, EchoBursts, Bools]:
    noise = default_noise(echo=Echo(share=share))
    readings = simulate_static(noise, seed, rate_hz=RATE_HZ, seconds=300.0, stations=("one",))
    series = rest_series(readings)[0]
    return series, find_echoes(series, LIMIT_M), readings.affected["echo"][: len(series), 0] & series.valid


@pytest.mark.parametrize("share", [0.03, 0.09])
def test_nearly_every_echo_is_found_and_nothing_else(share: float) -> None:
    series, bursts, true = found_and_true(share, 1001)
    found = bursts.mask(len(series))
    assert np.sum(found & ~true) <= 2
    assert np.sum(true & ~found) <= 0.04 * true.sum()


def test_missing_rows_hold_the_last_valid_one() -> None:
    values = np.arange(5.0)[:, None]
    valid = np.array([False, True, False, True, False])
    assert hold(values, valid)[:, 0].tolist() == [1.0, 1.0, 1.0, 3.0, 3.0]


def with_bursts(
    *bursts: tuple[int, int, tuple[float, ...]], lost: slice = slice(0, 0)
) -> tuple[np.ndarray, np.ndarray]:
    (quiet,) = at_rest(QUIET, 1)
    place_m, quality = quiet.position_m.copy(), np.ones(len(quiet))
    for begin, end, offset_m in bursts:
        place_m[begin:end] += offset_m
    quality[lost] = 0.0
    return place_m, quality


def test_bursts_are_found_with_length_and_size() -> None:
    planted = ((500, 501, (0.06, 0.0, 0.0)), (1000, 1008, (0.0, 0.1, 0.2)), (3000, 3003, (-0.03, 0.0, 0.04)))
    found = find_echoes(planted_series(*with_bursts(*planted)), LIMIT_M)
    assert found.begin.tolist() == [500, 1000, 3000]
    assert found.end.tolist() == [501, 1008, 3003]
    assert found.size_m == pytest.approx([0.06, np.sqrt(0.05), 0.05], abs=0.004)
    assert found.whole.all()
    assert np.flatnonzero(found.mask(4800)).tolist() == [500, *range(1000, 1008), 3000, 3001, 3002]


def test_bursts_that_touch_are_parted() -> None:
    planted = ((700, 704, (0.1, 0.0, 0.0)), (704, 709, (0.0, 0.15, 0.0)))
    found = find_echoes(planted_series(*with_bursts(*planted)), LIMIT_M)
    assert list(zip(found.begin.tolist(), found.end.tolist(), strict=True)) == [(700, 704), (704, 709)]
    assert found.size_m == pytest.approx([0.1, 0.15], abs=0.004)


def test_a_burst_at_a_gap_is_not_whole() -> None:
    found = find_echoes(planted_series(*with_bursts((700, 704, (0.1, 0.0, 0.0)), lost=slice(704, 720))), LIMIT_M)
    assert found.end.tolist() == [704]
    assert found.whole.tolist() == [False]


def test_an_excursion_of_three_centimetres_is_no_echo() -> None:
    since = np.arange(4800) / 40.0 - 50.0
    share = np.clip(np.minimum(since, 3.2 - since) / 0.2, 0.0, 1.0)
    place_m, quality = with_bursts()
    place_m += share[:, None] * np.array([0.03, 0.0, 0.0])
    assert len(find_echoes(planted_series(place_m, quality), LIMIT_M).begin) == 0


def test_the_limit_grows_with_the_noise() -> None:
    assert echo_limit_m(0.00075, 0.0015, 1.0) == LEAST_ECHO_M
    assert echo_limit_m(0.004, 0.0, 1.0) == pytest.approx(0.032)
    assert echo_limit_m(0.0, 0.01, 0.35) == pytest.approx(0.08)
