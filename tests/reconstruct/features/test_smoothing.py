"""Eq. 6: its weights, and the shorter arc for rotations."""

import numpy as np
import pytest

from harness.core import rotations
from harness.reconstruct.features.pose_space import slerp, smooth_rotation, smoothing_weights

ALPHA, BETA = 0.3, 0.4


def test_the_papers_constants_weigh_three_frames() -> None:
    np.testing.assert_allclose(smoothing_weights(ALPHA, BETA), [0.60, 0.28, 0.12], atol=1e-15)


def test_on_one_axis_the_rotation_is_the_weighted_angle(rng: np.random.Generator) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    angles = rng.uniform(-0.7, 0.7, 3)
    now, before, earlier = rotations.exp(angles[:, None] * axis)
    blended = smooth_rotation(now, before, earlier, ALPHA, BETA)
    np.testing.assert_allclose(rotations.log(blended), (smoothing_weights(ALPHA, BETA) @ angles) * axis, atol=1e-12)


def test_every_step_of_the_blend_lies_on_the_geodesic(rng: np.random.Generator) -> None:
    now, before, earlier = rotations.exp(rng.normal(size=(3, 5, 3)))
    past = slerp(before, earlier, ALPHA)
    apart = rotations.angle_between_rad(before, earlier)
    np.testing.assert_allclose(rotations.angle_between_rad(before, past), ALPHA * apart, atol=1e-9)
    np.testing.assert_allclose(rotations.angle_between_rad(past, earlier), (1.0 - ALPHA) * apart, atol=1e-9)
    blended = smooth_rotation(now, before, earlier, ALPHA, BETA)
    apart = rotations.angle_between_rad(now, past)
    np.testing.assert_allclose(rotations.angle_between_rad(now, blended), BETA * apart, atol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sign_of_a_quaternion_does_not_matter(rng: np.random.Generator, sign: float) -> None:
    start, stop = rotations.exp(rng.normal(size=(2, 3)))
    once, again = slerp(start, stop, 0.3), slerp(start, sign * stop, 0.3)
    np.testing.assert_allclose(rotations.angle_between_rad(once, again), 0.0, atol=1e-9)


def test_a_pose_that_stays_stays(rng: np.random.Generator) -> None:
    still = rotations.exp(rng.normal(size=3))
    np.testing.assert_allclose(smooth_rotation(still, still, still, ALPHA, BETA), still, atol=1e-12)
    assert sum(smoothing_weights(ALPHA, BETA)) == pytest.approx(1.0)
