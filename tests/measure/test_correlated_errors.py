"""Least squares with Gauss-Markov errors."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.measure.correlated_errors import ErrorProcess, fit_process
from tests.measure.moving_bodies import gauss_markov

PERIOD_S = 0.025


def covariance(process: ErrorProcess, count: int) -> Floats:
    lag_s = PERIOD_S * np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    out: Floats = process.drift**2 * np.exp(-lag_s / process.correlation_s) + process.white**2 * np.eye(count)
    return out


def test_filter_is_generalised_least_squares(rng: np.random.Generator) -> None:
    """Sums of products of filtered columns are those with the inverse of the covariance, samples left out as well."""
    process, count = ErrorProcess(0.3, 1.2, 0.4), 60
    values, valid = rng.normal(size=(count, 4)), rng.random(count) > 0.2
    white = process.whiten(values, valid, PERIOD_S)
    expected = values[valid].T @ np.linalg.solve(covariance(process, count)[np.ix_(valid, valid)], values[valid])
    np.testing.assert_allclose(white.T @ white, expected, rtol=1e-9)
    np.testing.assert_array_equal(white[~valid], 0.0)


@pytest.mark.parametrize(("white", "drift", "correlation_s"), [(0.5, 2.0, 1.0), (1.0, 1.0, 0.3)])
def test_fit_finds_the_process(white: float, drift: float, correlation_s: float, rng: np.random.Generator) -> None:
    count = 20_000
    errors = drift * gauss_markov(rng, count, float(np.exp(-PERIOD_S / correlation_s)))
    errors += white * rng.normal(size=errors.shape)
    found = fit_process(errors, rng.random(count) > 0.1, PERIOD_S)
    assert found.white == pytest.approx(white, rel=0.05)
    assert found.drift == pytest.approx(drift, rel=0.1)
    assert found.correlation_s == pytest.approx(correlation_s, rel=0.15)
