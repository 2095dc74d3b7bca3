"""Readings that are left out, and the covariance over blocks."""

import numpy as np

from harness.measure.registration_fit import StationGrid, _agreeing, _covariance


def test_excursions_are_left_out_with_their_ends_and_across_gaps(rng: np.random.Generator) -> None:
    known = np.ones(400, bool)
    known[110:114] = False
    grid = StationGrid(0.025, np.arange(400.0) * 0.025, np.zeros((400, 3)), np.zeros((400, 4)), known)
    residual = 0.001 * rng.uniform(-1.0, 1.0, (400, 6))
    residual[100:125, 0] += 0.03
    residual[300:302, 0] += 0.2
    residual[~known] = 0.0
    used = _agreeing(residual, grid)
    np.testing.assert_array_equal(np.flatnonzero(~used[:, 0]), [*range(88, 137), *range(299, 303)])
    np.testing.assert_array_equal(~used[:, 1], ~known)


def test_blocks_that_scatter_more_enlarge_the_covariance() -> None:
    information = np.diag([4.0, 1.0, 2.0])
    np.testing.assert_allclose(_covariance(information, np.diag([36.0, 0.1, 5.0]), 12, [2]), np.diag([2.25, 1.0, 0.0]))
