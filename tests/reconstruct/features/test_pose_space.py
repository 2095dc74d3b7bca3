"""Poses as hinge angles and as joint quaternions."""

import numpy as np
import pytest

from harness.body import build_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.skeleton import world_rotations
from harness.reconstruct.features.pose_space import (
    HingeAngles,
    JointQuaternions,
    slerp,
    smooth_rotation,
    smoothing_weights,
)
from harness.reconstruct.solver.ground_frame import HINGES
from harness.reconstruct.solver.hinge_limits import HingeLimits

BODY = build_body()
LIMITS = HingeLimits(BODY)
QUATERNIONS = JointQuaternions(BODY, LIMITS)


def poses(rng: np.random.Generator, count: int) -> Floats:
    """(count, 55) poses within the limits, near each other."""
    out = np.concatenate([[1.0], np.zeros(54)]) + 0.05 * rng.standard_normal((count, 55))
    out[:, HINGES] = LIMITS.clip(out[:, HINGES])
    return out


def bone_rotations(pose: Floats) -> Floats:
    """(B, 3, 3) rotations of the bones, by forward kinematics."""
    out: Floats = world_rotations(BODY.skeleton, rotations.IDENTITY[None], pose[HINGES][QPOS_OF_DOF][None])[0]
    return out


def test_a_pose_comes_back(rng: np.random.Generator) -> None:
    for pose in poses(rng, 5):
        for space in (HingeAngles(), QUATERNIONS):
            np.testing.assert_allclose(space.decode(space.encode(pose[None])[0]), pose, atol=1e-9)


def test_the_weight_of_one_neighbour_gives_its_pose(rng: np.random.Generator) -> None:
    examples = poses(rng, 4)
    for space in (HingeAngles(), QUATERNIONS):
        coordinates = space.encode(examples)
        found = space.decode(space.blend(np.array([0.0, 0.0, 1.0, 0.0]), coordinates))
        np.testing.assert_allclose(found, examples[2], atol=1e-9)


def test_quaternions_blend_halfway_between_two_rotations_of_one_axis(rng: np.random.Generator) -> None:
    """The elbow has one hinge, so the normalised mean of two quaternions is the rotation by the mean angle."""
    dof = BODY.skeleton.dof_names.index("lradius.rx")
    place = HINGES.start + int(np.flatnonzero(dof == QPOS_OF_DOF)[0])
    both = np.repeat(poses(rng, 1), 2, axis=0)
    both[:, place] = 0.3, 1.1
    found = QUATERNIONS.decode(QUATERNIONS.blend(np.array([0.5, 0.5]), QUATERNIONS.encode(both)))
    assert found[place] == pytest.approx(0.7, abs=1e-9)


def test_signs_are_those_of_the_nearest_neighbour(rng: np.random.Generator) -> None:
    """A hinge turned by a full turn has the opposite quaternion; its blend is unchanged."""
    both = np.repeat(poses(rng, 1), 2, axis=0)
    both[1, HINGES] += 2.0 * np.pi
    found = QUATERNIONS.blend(np.array([0.5, 0.5]), QUATERNIONS.encode(both))
    np.testing.assert_allclose(bone_rotations(QUATERNIONS.decode(found)), bone_rotations(both[0]), atol=1e-9)


def test_smoothing_is_equation_6_on_the_rotations(rng: np.random.Generator) -> None:
    """slerp(y_t, slerp(y_t-1, y_t-2, alpha), beta), written with rotation vectors, for the left shoulder."""
    now, before, earlier = poses(rng, 3)
    alpha, beta = 0.3, 0.4
    coordinates = [QUATERNIONS.encode(pose[None])[0] for pose in (now, before, earlier)]
    smoothed = QUATERNIONS.smooth(coordinates[0], coordinates[1], coordinates[2], alpha, beta)
    y, y1, y2 = (c[7:].reshape(-1, 4) for c in coordinates)

    def towards(p: Floats, q: Floats, share: float) -> Floats:
        return rotations.multiply(p, rotations.exp(share * rotations.log(rotations.multiply(rotations.inverse(p), q))))

    expected = towards(y, towards(y1, y2, alpha), beta)
    np.testing.assert_allclose(smoothed[7:].reshape(-1, 4), expected, atol=1e-12)
    exchanged = towards(y, towards(y2, y1, alpha), beta)
    assert np.abs(expected - exchanged).max() > 1e-4
    w, w1, w2 = smoothing_weights(alpha, beta)
    assert (w, w1, w2) == pytest.approx((0.6, 0.28, 0.12))
    np.testing.assert_allclose(smoothed[:7], w * coordinates[0][:7] + w1 * coordinates[1][:7] + w2 * coordinates[2][:7])


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
