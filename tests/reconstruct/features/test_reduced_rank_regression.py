"""Reduced-rank regression against its definition, by singular values of the prediction."""

import numpy as np

from harness.reconstruct.methods.dynamic_map import DynamicMap
from tests.reconstruct.conftest import Scene


def test_directions_are_the_leading_ones_of_the_prediction(walk: Scene) -> None:
    """Their coordinates are uncorrelated over the examples, by decreasing variance, and 40 of them hold nearly all."""
    regression = DynamicMap().fit(walk.body, [walk.take], np.random.default_rng(0)).regression(walk.calibration)
    columns = regression.columns(np.ones(2 * regression.count, bool))
    directions = regression.directions(columns)
    assert directions.shape == (columns.sum(), 40)
    covariance = directions.T @ regression.scatter[np.ix_(columns, columns)] @ directions
    variance = np.diag(covariance)
    assert (np.diff(variance) <= 1e-9 * variance[0]).all()
    assert np.abs(covariance - np.diag(variance)).max() < 1e-8 * variance[0]
    assert variance[20] < 0.1 * variance[1]
    assert variance[0] > 0.0
