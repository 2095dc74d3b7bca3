"""The robust slope: exact lines, outliers, and the coverage of its interval with correlated errors."""

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.measure.robust_slope import robust_slope
from harness.simulate.components.stationary import gauss_markov


def test_a_line_has_its_slope_and_no_width() -> None:
    at = np.arange(40.0)
    assert robust_slope(at, 3.0 - 0.25 * at) == pytest.approx((-0.25, -0.25, -0.25))


def test_outliers_of_one_side_do_not_turn_the_line() -> None:
    at = np.arange(60.0)
    late = np.where(generator(1, "late").uniform(size=60) < 0.15, 20.0, 0.0)
    slope, low, high = robust_slope(at, 0.1 * at + late)
    assert slope == pytest.approx(0.1, abs=1e-9)
    assert low <= 0.1 <= high


def test_a_few_values_have_the_interval_of_sen() -> None:
    from scipy import stats

    at, values = np.arange(7.0), np.array([0.0, 1.2, 1.9, 3.1, 3.8, 5.3, 6.0])
    expected = stats.theilslopes(values, at, 0.95)
    assert robust_slope(at, values) == pytest.approx((expected[0], expected[2], expected[3]))


@pytest.mark.long
@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_intervals_contain_the_slope_with_correlated_errors(correlation: float) -> None:
    at, rounds = np.arange(60.0), 100
    inside = 0
    for seed in range(rounds):
        errors = gauss_markov(generator(seed, "errors").normal(size=(60, 1)), correlation)[:, 0]
        _, low, high = robust_slope(at, 0.5 * at + errors)
        inside += low <= 0.5 <= high
    assert inside >= 88
