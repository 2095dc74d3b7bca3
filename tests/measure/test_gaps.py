"""Gaps and coastings of simulated losses."""

import numpy as np
import pytest

from harness.measure.episode_distributions import fit_length
from harness.measure.gaps import find_gaps_at_rest, leaked_tilt_rad
from harness.simulate.components.transient import Dropout
from harness.simulate.noise import Noise
from tests.measure.resting_stations import RATE_HZ, default_noise, rest_series, simulate_rest, simulate_static


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
