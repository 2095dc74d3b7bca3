"""Periods and grids of samples at uneven times."""

import numpy as np
import pytest

from harness.measure.sampling import mean_period_s, own_places_s


def test_the_period_of_an_even_source_ignores_lost_samples() -> None:
    time_s = np.arange(1000) / 40.0
    kept = np.arange(1000) % 7 != 3
    assert mean_period_s([time_s[kept], np.array([np.nan, 3.0])]) == pytest.approx(0.025)


def test_the_period_of_times_printed_to_10_ms_is_not_rounded() -> None:
    time_s = np.round(np.arange(1000) / 30.0, 2)
    assert np.median(np.diff(time_s)) == pytest.approx(0.03)
    assert mean_period_s([time_s]) == pytest.approx(1.0 / 30.0, rel=1e-3)


def test_samples_get_places_of_their_own(rng: np.random.Generator) -> None:
    even = 3.0 + np.arange(2000) / 40.0
    assert own_places_s([even], 0.025) == 0.025
    uneven = np.cumsum(rng.uniform(0.012, 0.07, 2000))
    step_s = own_places_s([even, uneven], mean_period_s([uneven]))
    assert 0.004 < step_s < 0.03
    places = np.rint((uneven - uneven[0]) / step_s)
    assert len(np.unique(places)) > 0.98 * len(uneven)
    crowded = np.sort(rng.uniform(0.0, 10.0, 2000))
    assert own_places_s([crowded], 0.005) == pytest.approx(0.005 / 8)
