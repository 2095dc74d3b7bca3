"""Ends, lengths, shares and counts of episodes: known values, and the coverage of their intervals."""

import numpy as np
import pytest

from harness.errors import BadInput
from harness.measure.episode_distributions import (
    FEWEST_VALUES,
    FEWEST_VECTORS,
    episode_share,
    events_for_precision,
    fit_length,
    fit_uniform,
    recording_minutes,
)


@pytest.mark.long
@pytest.mark.parametrize(("count", "deviation"), [(30, 0.0), (30, 0.05), (300, 0.05), (300, 0.2)])
def test_the_intervals_cover_the_ends(count: int, deviation: float) -> None:
    rng = np.random.default_rng(count)
    covered = np.zeros(3)
    for _ in range(80):
        values = rng.uniform(1.0, 2.0, count) + deviation * rng.normal(size=count)
        low, high, mean = fit_uniform(values, deviation)
        covered += [low.contains(1.0), high.contains(2.0), mean.contains(1.5)]
    assert np.all(covered >= 68)  # of 80; the ends of 30 values without errors are covered in 93 %


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


def lengths(length: float, deviation: float, count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    vectors = length * np.stack([np.cos(angle), np.sin(angle)], axis=1) + deviation * rng.normal(size=(count, 2))
    return np.asarray(np.linalg.norm(vectors, axis=1))


@pytest.mark.long
@pytest.mark.parametrize("length", [0.5, 1.0, 4.0])
def test_the_interval_covers_the_length(length: float) -> None:
    covered = [fit_length(lengths(length, 1.0, 60, seed), 1.0).contains(length) for seed in range(100)]
    assert 0.90 <= np.mean(covered) <= 1.0


def test_noise_alone_has_no_length_and_strays_do_not_count() -> None:
    assert fit_length(lengths(0.0, 1.0, 200, 1), 1.0).low == 0.0
    values = np.concatenate([lengths(4.0, 1.0, 100, 2), [15.0, 20.0]])
    assert fit_length(values, 1.0).contains(4.0)


def test_few_vectors_give_no_length() -> None:
    assert "coastings" in fit_length(np.ones(FEWEST_VECTORS - 1), 1.0).reason


@pytest.mark.parametrize("expected", [2.0, 20.0, 200.0])
def test_the_interval_covers_the_share(expected: float) -> None:
    rng = np.random.default_rng(1)
    total = 1_000_000  # so long that episodes hardly meet
    covered = []
    for _ in range(1000):
        lengths = rng.integers(4, 21, rng.poisson(expected)).astype(float)
        covered.append(episode_share(lengths, total, 20.0).contains(12.0 * expected / total))
    assert 0.94 <= np.mean(covered) <= 0.995


def test_a_large_share_scatters_less() -> None:
    lengths = np.full(100, 10.0)
    few, many = episode_share(lengths, 100_000, 10.0), episode_share(lengths, 2000, 10.0)
    assert many.high / many.value - 1.0 == pytest.approx(0.5 / 0.99 * (few.high / few.value - 1.0), rel=1e-6)


def test_no_episode_and_no_reading() -> None:
    nothing = episode_share(np.zeros(0), 1000, 10.0)
    assert (nothing.value, nothing.low) == (0.0, 0.0)
    assert nothing.high == pytest.approx(36.89 / 1000.0, rel=1e-3)  # 10 samples times the limit of Garwood 1936
    assert not episode_share(np.zeros(0), 0, 1.0).is_measured


def test_a_rate_to_20_percent_takes_about_100_events_and_17_minutes() -> None:
    assert events_for_precision(0.2) == 97
    assert recording_minutes(0.2, 1.0, 6) == pytest.approx(97 / 6)


def test_95_percent_of_counts_are_within_the_precision() -> None:
    events = events_for_precision(0.1)
    counts = np.random.default_rng(1).poisson(events, 100_000)
    assert np.mean(np.abs(counts / events - 1.0) <= 0.1) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("wrong", [(0.0, 1.0, 6), (1.0, 1.0, 6), (0.2, 0.0, 6), (0.2, 1.0, 0)])
def test_impossible_wishes_are_refused(wrong: tuple[float, float, int]) -> None:
    with pytest.raises(BadInput):
        recording_minutes(*wrong)
