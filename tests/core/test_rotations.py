"""Means of rotations, the nearest rotation and cross products as matrices."""

import numpy as np
import pytest

from harness.core import compiled_rotations, rotations
from harness.core.compiled_rotations import as_tuple


def test_the_mean_is_that_of_quaternions(rng: np.random.Generator) -> None:
    """Markley et al. 2007: the largest eigenvector of the sum of outer products; rows of NaN do not count."""
    spread = rotations.multiply(rotations.exp(rng.normal(size=3)), rotations.exp(0.5 * rng.normal(size=(40, 3))))
    spread[::3] *= -1.0  # the same orientations
    expected = np.linalg.eigh(spread.T @ spread)[1][:, -1]
    with_nan = np.insert(spread, 7, np.nan, axis=0)
    assert rotations.angle_between_rad(rotations.mean_rotation(with_nan), expected) < 1e-14


def test_the_nearest_rotation_is_found_for_each_matrix(rng: np.random.Generator) -> None:
    turn = rotations.to_matrix(rotations.exp(rng.normal(size=(3, 5, 3))))
    stretched = turn @ np.diag([3.0, 2.0, 0.5])
    np.testing.assert_allclose(rotations.nearest_rotation(stretched), turn, atol=1e-14)
    anything = rng.normal(size=(50, 3, 3))
    nearest = rotations.nearest_rotation(anything)
    assert np.linalg.det(nearest) == pytest.approx(np.ones(50))
    near = rotations.to_matrix(rotations.exp(1e-2 * rng.normal(size=(50, 3)))) @ nearest
    assert np.all(np.sum(near * anything, axis=(1, 2)) <= np.sum(nearest * anything, axis=(1, 2)))


def test_cross_matrices_multiply_as_cross_products(rng: np.random.Generator) -> None:
    u, v = rng.normal(size=(2, 4, 6, 3))
    found = (rotations.cross_matrix(u) @ v[..., None])[..., 0]
    np.testing.assert_allclose(found, np.cross(u, v), atol=1e-14)


ANGLES_RAD = [0.0, 1e-12, 1e-7, 1e-3, 1.0, 3.0, np.pi - 1e-6, np.pi]


def test_products_and_rotated_vectors_agree_with_numpy(rng: np.random.Generator) -> None:
    p, q, v = rotations.exp(rng.normal(size=3)), rotations.exp(rng.normal(size=3)), rng.normal(size=3)
    product = compiled_rotations.quaternion_product(as_tuple(p), as_tuple(q))
    np.testing.assert_allclose(product, rotations.multiply(p, q), atol=1e-15)
    np.testing.assert_allclose(compiled_rotations.rotate(as_tuple(q), *v), rotations.rotate(q, v), atol=1e-14)


@pytest.mark.parametrize("angle_rad", ANGLES_RAD)
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, -0.6, 0.8), (0.48, 0.6, 0.64)])
def test_rotations_survive_each_representation(axis: tuple[float, float, float], angle_rad: float) -> None:
    vector = angle_rad * np.array(axis)
    turn = np.array(compiled_rotations.quaternion_from_vector(*vector))
    np.testing.assert_allclose(turn, rotations.exp(vector), atol=1e-15)
    matrix = compiled_rotations.matrix_from_quaternion(turn)
    np.testing.assert_allclose(matrix, rotations.to_matrix(turn), atol=1e-15)
    assert rotations.angle_between_rad(compiled_rotations.quaternion_from_matrix(matrix), turn) < 1e-7
    for sign in (1.0, -1.0):  # the same rotation
        found = np.array(compiled_rotations.rotation_vector(as_tuple(sign * turn)))
        assert rotations.angle_between_rad(rotations.exp(found), turn) < 1e-11
        assert np.linalg.norm(found) < np.pi + 1e-9
