"""Readings that are left out, and the covariance over blocks."""

import numpy as np

from harness.measure.registration_fit import _agreeing, _Block, _corrected_score, _covariance
from harness.measure.station_grid import StationGrid


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


def test_corrected_scores_of_a_block_scatter_as_its_errors_do(rng: np.random.Generator) -> None:
    """Residuals scatter less than errors, most in blocks that the fit follows; the third parameter is fixed."""
    slopes = [rng.normal(size=(9, 3)) * size for size in (1.0, 1.0, 3.0)]
    information = [one.T @ one for one in slopes]
    total = np.sum(information, axis=0)[:2, :2]
    inverse = np.zeros((3, 3))
    inverse[:2, :2] = np.linalg.inv(total)
    for own in information:
        basis = (_Block([0, 1, 2], own, unit) for unit in np.eye(3))
        correction = np.array([_corrected_score(block, inverse, [2]) for block in basis]).T[:2, :2]
        of_residuals = own[:2, :2] - own[:2, :2] @ inverse[:2, :2] @ own[:2, :2]
        np.testing.assert_allclose(correction @ of_residuals @ correction.T, own[:2, :2], rtol=1e-9)


def test_blocks_that_scatter_more_enlarge_the_covariance() -> None:
    information = np.diag([4.0, 1.0, 2.0])
    np.testing.assert_allclose(_covariance(information, np.diag([36.0, 0.1, 5.0]), [2]), np.diag([2.25, 1.0, 0.0]))
