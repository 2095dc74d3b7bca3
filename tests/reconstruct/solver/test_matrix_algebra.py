"""Small matrices against numpy."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.reconstruct.solver import matrix_algebra
from harness.reconstruct.solver.matrix_algebra import factorise, new_rows, solve_factorised


def test_matrices_agree_with_numpy(rng: np.random.Generator) -> None:
    a, b, u, v = *rng.normal(size=(2, 3, 3)), *rng.normal(size=(2, 3))
    np.testing.assert_allclose(matrix_algebra.multiply(a, b), a @ b, atol=1e-14)
    np.testing.assert_allclose(matrix_algebra.multiply_transposed(a, b), a @ b.T, atol=1e-14)
    np.testing.assert_allclose(matrix_algebra.transposed_multiply(a, b), a.T @ b, atol=1e-14)
    np.testing.assert_allclose(matrix_algebra.multiply_vector(a, v), a @ v, atol=1e-14)
    np.testing.assert_allclose(matrix_algebra.cross(u, v), np.cross(u, v), atol=1e-14)
    np.testing.assert_allclose(matrix_algebra.dot(u, v), u @ v, atol=1e-14)
    np.testing.assert_allclose(matrix_algebra.dot3(u, v), u @ v, atol=1e-14)


@pytest.mark.parametrize("start", [(2.0, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.3, -1.2, 0.7)])
def test_the_shortest_rotation_reaches_its_direction(start: tuple[float, float, float]) -> None:
    direction = np.array([1.0, 0.0, 0.0])
    rotation = matrix_algebra.shortest_rotation(np.array(start), direction)
    np.testing.assert_allclose(rotation @ np.array(start), np.linalg.norm(start) * direction, atol=1e-12)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("angle_rad", [0.0, 1e-6, 1.0, 3.0, np.pi])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, -0.6, 0.8), (0.48, 0.6, 0.64)])
def test_the_angle_about_an_axis_is_that_of_the_rotation(axis: tuple[float, float, float], angle_rad: float) -> None:
    matrix = rotations.to_matrix(rotations.exp(angle_rad * np.array(axis)))
    np.testing.assert_allclose(matrix_algebra.axis_rotation(np.array(axis), angle_rad), matrix, atol=1e-14)
    assert abs(abs(matrix_algebra.angle_about(np.array(axis), matrix)) - angle_rad) < 1e-7


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
