"""The factor of dense positive definite matrices against numpy."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.reconstruct.solver.matrix_algebra import factorise, new_rows, solve_factorised


def padded(matrix: Floats) -> Floats:
    """The lower triangle of a matrix (N, N) in padded rows."""
    out = new_rows(len(matrix))
    out[:, : len(matrix)] = np.tril(matrix)
    return out


@pytest.mark.parametrize("count", [1, 2, 3, 7, 8, 9, 54, 55])
def test_solutions_are_those_of_numpy(count: int, rng: np.random.Generator) -> None:
    half = rng.normal(size=(count, count + 3)) * np.geomspace(1.0, 1e-2, count)[:, None]
    matrix, x = half @ half.T, rng.normal(size=count)
    rows = padded(matrix)
    assert factorise(rows)
    found = x.copy()
    solve_factorised(rows, found)
    np.testing.assert_allclose(matrix @ found, x, atol=1e-9 * np.abs(found).max())


def test_what_lies_beyond_the_diagonal_does_not_matter(rng: np.random.Generator) -> None:
    half, x = rng.normal(size=(9, 20)), rng.normal(size=9)
    rows, other = padded(half @ half.T), new_rows(9)
    other[:] = rng.normal(size=other.shape)
    other[:, :9] = np.where(np.tri(9, dtype=bool), rows[:, :9], other[:, :9])
    found, same = x.copy(), x.copy()
    for factor, solution in ((rows, found), (other, same)):
        assert factorise(factor)
        solve_factorised(factor, solution)
    np.testing.assert_array_equal(found, same)


@pytest.mark.parametrize("count", [4, 5])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_any_pivot_that_is_not_positive_is_found(count: int, value: float) -> None:
    for k in range(count):
        matrix = np.eye(count)
        matrix[k, k] = value
        assert not factorise(padded(matrix))
