"""The compiled 3 x 3 algebra against numpy."""

import numpy as np
import pytest

from harness.core import rotations
from harness.reconstruct.solver import matrix_algebra


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
