"""Likelihood of white noise and drift, against dense matrices."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core.arrays import Bools, Floats
from harness.core.seeds import generator
from harness.measure.gauss_markov import (
    ErrorProcess,
    fit_process,
    kalman_gains,
    series_log_likelihood,
    transpose_whiten,
    whiten,
)
from tests.measure.moving_bodies import gauss_markov


def dense_covariance(used: Bools, rate_hz: float, white: float, drift: float, correlation_s: float) -> Floats:
    time_s = np.flatnonzero(used) / rate_hz
    apart_s = np.abs(time_s[:, None] - time_s)
    out: Floats = drift**2 * np.exp(-apart_s / correlation_s) + white**2 * np.eye(len(time_s))
    return out


def dense_log_likelihood(values: Floats, used: Bools, covariance: Floats) -> float:
    """Restricted likelihood of Patterson and Thompson 1971, with the constant of an orthonormal contrast."""
    seen, ones = values[used], np.ones(int(used.sum()))
    inverse = np.linalg.inv(covariance)
    norm = ones @ inverse @ ones
    total = 0.0
    for axis in seen.T:
        residual = axis - ones @ inverse @ axis / norm
        total -= 0.5 * (residual @ inverse @ residual + np.linalg.slogdet(covariance)[1] + np.log(norm))
        total -= 0.5 * (len(axis) - 1) * np.log(2.0 * np.pi)
    return total


@settings(deadline=None, max_examples=40)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 60),
    st.floats(0.0, 0.6),
    st.floats(0.1, 2.0),
    st.floats(0.1, 2.0),
    st.floats(0.02, 5.0),
)
def test_the_likelihood_is_that_of_a_dense_covariance(
    seed: int, count: int, missing: float, white: float, drift: float, correlation_s: float
) -> None:
    rng = generator(seed, "likelihood")
    values = 3.0 + rng.normal(size=(count, 2))
    used = rng.uniform(size=count) >= missing
    if used.sum() < 2:
        used[:2] = True
    found = series_log_likelihood(
        np.where(used[:, None], values, np.nan), used, np.exp(-1.0 / (10.0 * correlation_s)), drift**2, white**2
    )
    expected = dense_log_likelihood(values, used, dense_covariance(used, 10.0, white, drift, correlation_s))
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8)


def test_long_series_keep_the_likelihood_when_the_variance_is_steady() -> None:
    values = generator(3, "long").normal(size=(900, 3))
    used = np.ones(900, bool)
    used[400:410] = False
    found = series_log_likelihood(values, used, np.exp(-1.0 / 4.0), 2.0, 0.5)
    expected = dense_log_likelihood(values, used, dense_covariance(used, 1.0, np.sqrt(0.5), np.sqrt(2.0), 4.0))
    assert found == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("seen", [0, 1])
def test_a_constant_takes_the_only_reading(seen: int) -> None:
    assert series_log_likelihood(np.ones((5, 1)), np.arange(5) < seen, 0.5, 1.0, 1.0) == 0.0


def test_whitening_is_the_inverse_of_the_cholesky_factor() -> None:
    rng = generator(4, "whiten")
    values, used = rng.normal(size=(80, 2)), rng.uniform(size=80) > 0.3
    found = ErrorProcess(0.7, 1.5, 0.8).whiten(np.where(used[:, None], values, np.nan), used, 0.1)
    factor = np.linalg.cholesky(dense_covariance(used, 10.0, 0.7, 1.5, 0.8))
    np.testing.assert_allclose(found[used], np.linalg.solve(factor, values[used]), atol=1e-10)
    assert not found[~used].any()


def test_the_transpose_has_the_same_products() -> None:
    rng = generator(9, "transpose")
    valid = rng.uniform(size=200) > 0.2
    gain, deviation = kalman_gains(valid, 0.97, 2.25, 0.56)
    one, other = rng.normal(size=(2, 200, 3))
    forward, backward = whiten(one, valid, gain, deviation, 0.97), transpose_whiten(other, valid, gain, deviation, 0.97)
    assert np.sum(forward * other) == pytest.approx(np.sum(one * backward), rel=1e-12)


PERIOD_S = 0.025


@pytest.mark.parametrize(("white", "drift", "correlation_s"), [(0.5, 2.0, 1.0), (1.0, 1.0, 0.3)])
def test_fit_finds_the_process(white: float, drift: float, correlation_s: float, rng: np.random.Generator) -> None:
    count = 20_000
    errors = drift * gauss_markov(rng, count, float(np.exp(-PERIOD_S / correlation_s)))
    errors += white * rng.normal(size=errors.shape)
    found = fit_process(errors, rng.random(count) > 0.1, PERIOD_S)
    assert found.white == pytest.approx(white, rel=0.05)
    assert found.drift == pytest.approx(drift, rel=0.1)
    assert found.correlation_s == pytest.approx(correlation_s, rel=0.15)


def test_without_drift_whitening_is_that_of_the_filter(rng: np.random.Generator) -> None:
    values, used = rng.normal(size=(50, 3)), rng.random(50) < 0.8
    gain, deviation = kalman_gains(used, 0.9, 0.0, 0.49)
    expected = whiten(np.where(used[:, None], values, 0.0), used, gain, deviation, 0.9)
    np.testing.assert_allclose(ErrorProcess(0.7, 0.0, 1.0).whiten(values, used, 0.1), expected, rtol=1e-14)
