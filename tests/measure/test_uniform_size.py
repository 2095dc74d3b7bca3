"""Ends of uniform distributions: coverage of their intervals, with and without errors and strays."""

import numpy as np
import pytest

from harness.measure.uniform_size import FEWEST_VALUES, fit_uniform


@pytest.mark.long
@pytest.mark.parametrize(("count", "deviation"), [(30, 0.0), (30, 0.05), (300, 0.0), (300, 0.05), (300, 0.2)])
def test_the_intervals_cover_the_ends(count: int, deviation: float) -> None:
    rng = np.random.default_rng(count)
    covered = np.zeros(3)
    for _ in range(200):
        values = rng.uniform(1.0, 2.0, count) + deviation * rng.normal(size=count)
        low, high, mean = fit_uniform(values, deviation)
        covered += [low.contains(1.0), high.contains(2.0), mean.contains(1.5)]
    assert np.all(covered >= 174)  # of 200; the ends of 30 values without errors are covered in 93 %


def test_without_errors_the_ends_are_the_extremes() -> None:
    values = np.linspace(3.0, 5.0, 50)
    low, high, mean = fit_uniform(values, 0.0)
    assert low.value == pytest.approx(3.0, abs=1e-3)
    assert high.value == pytest.approx(5.0, abs=1e-3)
    assert mean.value == pytest.approx(4.0)
    # The interval ends where the likelihood of the extremes falls to exp(-5.991 / 2).
    assert high.high - 5.0 == pytest.approx(2.0 * (np.exp(0.5 * 5.991 / 50) - 1.0), rel=0.02)


def test_errors_move_the_ends_inwards() -> None:
    values = np.random.default_rng(1).uniform(1.0, 2.0, 400) + 0.1 * np.random.default_rng(2).normal(size=400)
    assert values.min() < 0.95
    low, high, _ = fit_uniform(values, 0.1)
    assert low.contains(1.0)
    assert high.contains(2.0)


def test_few_strays_do_not_move_the_ends() -> None:
    values = np.concatenate([np.random.default_rng(1).uniform(1.0, 2.0, 200), [0.2, 3.5, 3.0]])
    low, high, _ = fit_uniform(values, 0.01, strays=0.05)
    assert low.contains(1.0)
    assert high.contains(2.0)
    assert not fit_uniform(values, 0.01)[1].contains(2.0)


def test_few_values_give_no_ends() -> None:
    assert not fit_uniform(np.ones(FEWEST_VALUES - 1), 0.1)[0].is_measured
