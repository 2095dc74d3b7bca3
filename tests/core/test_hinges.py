"""Angles of a bone's hinges: they come back, nothing comes nearer, and twins are one rotation."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.hinges import are_gimbal, equivalent_euler_angles, hinge_angles, hinge_rotation
from harness.core.humanoid24 import standard_skeleton


@pytest.mark.parametrize("bone", ["lfemur", "lhand", "lclavicle", "rtibia", "lwrist", "lhipjoint"])
def test_angles_of_any_bone_come_back(bone: str, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    axes = skeleton.axes[skeleton.dof_of_bone[skeleton.index(bone)]]
    angles = rng.uniform(-1.5, 1.5, size=(200, len(axes)))
    found = hinge_angles(axes, hinge_rotation(axes, angles))
    assert found.shape == angles.shape
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * angles), atol=1e-9)


@pytest.mark.parametrize("bone", ["lfemur", "lhand", "rclavicle", "rtibia", "lwrist"])
def test_no_other_angles_come_nearer(bone: str, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    axes = skeleton.axes[skeleton.dof_of_bone[skeleton.index(bone)]]
    wanted = rotations.exp(rng.normal(size=(40, 3)))
    best = hinge_angles(axes, wanted)
    error = rotations.angle_between_rad(hinge_rotation(axes, best), wanted)
    for _ in range(300):
        other = best + rng.normal(size=best.shape) * rng.choice([0.01, 0.3, 3.0])
        assert np.all(rotations.angle_between_rad(hinge_rotation(axes, other), wanted) > error - 1e-9)


@pytest.mark.parametrize("middle_rad", [np.pi / 2, -np.pi / 2])
def test_gimbal_lock_still_gives_the_rotation(middle_rad: float) -> None:
    axes = np.eye(3)
    locked = hinge_rotation(axes, np.array([[0.4, middle_rad, -0.7]]))
    again = hinge_rotation(axes, hinge_angles(axes, locked))
    assert rotations.angle_between_rad(again, locked).max() < 1e-7


def test_twins_are_one_rotation(rng: np.random.Generator) -> None:
    angles = rng.uniform(-3.0, 3.0, size=(50, 3))
    apart = rotations.angle_between_rad(
        *(hinge_rotation(np.eye(3), a) for a in (angles, equivalent_euler_angles(angles)))
    )
    assert apart.max() < 1e-7


def test_three_square_hinges_are_a_gimbal() -> None:
    skew = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    assert are_gimbal(np.eye(3)[[2, 0, 1]])
    assert not are_gimbal(np.eye(3)[:2])
    assert not are_gimbal(skew)
