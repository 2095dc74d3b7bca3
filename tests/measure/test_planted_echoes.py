"""Echoes at rest: bursts with their lengths and sizes, and what is none."""

import numpy as np
import pytest

from harness.measure.echoes import LEAST_ECHO_M, echo_limit_m, find_echoes, hold
from tests.measure.resting_stations import QUIET, at_rest, planted_series

LIMIT_M = 0.025


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


def test_held_values_are_the_last_valid_ones() -> None:
    values, valid = np.arange(5.0)[:, None], np.array([False, True, False, False, True])
    assert hold(values, valid)[:, 0].tolist() == [1.0, 1.0, 1.0, 1.0, 4.0]
