"""Shares of episodes: coverage for few and many episodes."""

import numpy as np
import pytest

from harness.measure.episode_share import episode_share


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
