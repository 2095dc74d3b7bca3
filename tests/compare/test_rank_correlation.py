"""Kendall's tau-b, against its definition and SciPy."""

import numpy as np
import pytest
from scipy import stats

from harness.compare.rank_correlation import tau_b


def test_a_tie_is_corrected() -> None:
    """Kendall 1970: one tie in six pairs on one side, all others in order."""
    found = tau_b(np.array([1.0, 2.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0, 4.0]))
    assert found == pytest.approx(5.0 / np.sqrt(5.0 * 6.0))


def test_it_is_kendalls_tau_b(rng: np.random.Generator) -> None:
    for _ in range(50):
        a, b = rng.integers(0, 5, (2, 8)).astype(float)  # with ties
        assert tau_b(a, b) == pytest.approx(stats.kendalltau(a, b, variant="b").statistic, nan_ok=True)
