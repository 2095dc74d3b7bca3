"""Whitening of white noise and drift across gaps, and its transpose."""

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.measure.correlated_errors import ErrorProcess
from harness.measure.whitening import kalman_gains, transpose_whiten, whiten
from tests.measure.test_gauss_markov import dense_covariance


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
