"""Common length of vectors among noise."""

import numpy as np
import pytest

from harness.measure.vector_length import FEWEST_VECTORS, fit_length


def lengths(length: float, deviation: float, count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    vectors = length * np.stack([np.cos(angle), np.sin(angle)], axis=1) + deviation * rng.normal(size=(count, 2))
    return np.asarray(np.linalg.norm(vectors, axis=1))


@pytest.mark.long
@pytest.mark.parametrize("length", [0.5, 1.0, 4.0])
def test_the_interval_covers_the_length(length: float) -> None:
    covered = [fit_length(lengths(length, 1.0, 60, seed), 1.0).contains(length) for seed in range(200)]
    assert 0.90 <= np.mean(covered) <= 0.995


def test_noise_alone_has_no_length_and_strays_do_not_count() -> None:
    assert fit_length(lengths(0.0, 1.0, 200, 1), 1.0).low == 0.0
    values = np.concatenate([lengths(4.0, 1.0, 100, 2), [15.0, 20.0]])
    assert fit_length(values, 1.0).contains(4.0)


def test_few_vectors_give_no_length() -> None:
    assert "coastings" in fit_length(np.ones(FEWEST_VECTORS - 1), 1.0).reason
