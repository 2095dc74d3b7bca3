"""Tests of gaps and echoes of readings at rest."""

import numpy as np
import pytest

from harness.core.arrays import Bools
from harness.measure.episode_distributions import fit_length
from harness.measure.gaps_and_echoes import (
    LEAST_ECHO_M,
    EchoBursts,
    echo_limit_m,
    find_echoes,
    find_gaps_at_rest,
    hold,
    leaked_tilt_rad,
)
from harness.measure.static_series import StaticSeries
from harness.simulate import Dropout, Echo, Noise
from tests.measure.resting_stations import (
    QUIET,
    RATE_HZ,
    at_rest,
    default_noise,
    planted_series,
    rest_series,
    simulate_rest,
    simulate_static,
)


def test_gaps_and_coastings_are_those_of_the_simulation() -> None:
    readings = simulate_static(Noise(dropout=Dropout(share=0.05)), 3, rate_hz=RATE_HZ, seconds=300.0, stations=("one",))
    series = rest_series(readings)[0]
    gaps = find_gaps_at_rest(series)
    count = len(series)
    np.testing.assert_array_equal(gaps.lost, readings.affected["lost"][:count, 0])
    np.testing.assert_array_equal(gaps.coasting, readings.affected["coast"][:count, 0])
    whole = gaps.whole & np.isfinite(gaps.coast_s)
    assert whole.sum() > 20
    np.testing.assert_allclose(gaps.coast_s[whole], 0.5, atol=0.003)


def test_a_coasting_that_a_gap_cuts_short_still_shows_its_slope() -> None:
    series = simulate_rest(Noise(dropout=Dropout(share=0.3, coast_s=1.0)), 4, 300.0, 1)[0]
    known = find_gaps_at_rest(series).coast_s
    assert np.nanmedian(known) == pytest.approx(1.0, abs=0.01)


def test_the_tilt_error_is_found_among_the_noise() -> None:
    noise = default_noise(excursion=None, echo=None, dropout=Dropout(share=0.05, tilt_rad=0.008))
    tilts, deviation = [], 0.0
    for series in simulate_rest(noise, 5, 300.0):
        gaps = find_gaps_at_rest(series)
        nothing = np.zeros(len(series), bool)
        own, deviation = leaked_tilt_rad(series, gaps.begin, 0.5, nothing, (0.00075, 0.0015, 1.0))
        tilts.append(own)
    length = fit_length(np.linalg.norm(np.concatenate(tilts), axis=1), deviation)
    assert length.contains(0.008)
    assert length.high - length.low < 0.001


def test_a_coasting_with_a_sample_that_is_left_out_is_skipped() -> None:
    series = simulate_rest(Noise(dropout=Dropout(share=0.05)), 5, 120.0, 1)[0]
    gaps = find_gaps_at_rest(series)
    all_out = np.ones(len(series), bool)
    assert len(leaked_tilt_rad(series, gaps.begin, 0.5, all_out, (1e-3, 1e-3, 1.0))[0]) == 0


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
