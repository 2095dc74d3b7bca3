"""Representations of hinge angles: the same rotation, within the limits."""

import numpy as np
import pytest

from harness.body import build_body
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack, unpack
from harness.core.skeleton import forward_kinematics
from harness.reconstruct.solver.hinge_limits import HingeLimits

LIMITS = HingeLimits(build_body())
SKELETON = build_body().skeleton


def orientations(angles_rad: Floats) -> Floats:
    """(T, 24, 3, 3) of angles in the order of qpos."""
    qpos = np.concatenate(
        [np.zeros((len(angles_rad), 3)), np.tile([1.0, 0, 0, 0], (len(angles_rad), 1)), angles_rad], 1
    )
    return forward_kinematics(SKELETON, *unpack(qpos)).world_from_bone


def lawful(rng: np.random.Generator, count: int) -> Floats:
    low, high = np.maximum(LIMITS.low_rad, -np.pi), np.minimum(LIMITS.high_rad, np.pi)
    return rng.uniform(low, high, (count, 48))


def twins(angles_rad: Floats) -> Floats:
    """The other representation of every three perpendicular hinges, written out in the skeleton's own order."""
    root_m, turn, angles = unpack(np.concatenate([np.zeros((len(angles_rad), 7)), angles_rad], axis=1))
    for where in SKELETON.dof_of_bone:
        if where.stop - where.start == 3:
            angles[:, where] = angles[:, where] * [1.0, -1.0, 1.0] + np.pi
    return pack(root_m, turn, angles)[:, 7:]


@pytest.mark.parametrize("turns", [0, 1, -2])
@pytest.mark.parametrize("twin", [False, True])
def test_principal_is_the_same_pose_within_limits(rng: np.random.Generator, turns: int, twin: bool) -> None:
    angles = lawful(rng, 50)
    disguised = (twins(angles) if twin else angles) + 2.0 * np.pi * turns
    found = LIMITS.principal(disguised)
    np.testing.assert_allclose(orientations(found), orientations(angles), atol=1e-9)
    assert np.max(LIMITS.excess_rad(found)) < 1e-9


def test_hinges_that_turn_all_round_have_no_limits() -> None:
    names = [build_body().model.joint(1 + d).name for d in range(48)]
    free = {name for name, low in zip(names, LIMITS.low_rad, strict=True) if np.isinf(low)}
    assert {"rhumerus.rx", "rhumerus.rz", "rwrist.ry"} <= free
    assert not any(name.endswith(("tibia.rx", "radius.rx")) for name in free)
    assert np.all(np.isinf(HingeLimits(build_body(), keep=False).high_rad))


def test_past_the_pole_is_noticed_and_mended() -> None:
    angles = np.zeros(48)
    names = [build_body().model.joint(1 + d).name for d in range(48)]
    assert not LIMITS.past_gimbal(angles)
    angles[names.index("rhumerus.ry")] = np.deg2rad(-120.0)
    assert LIMITS.past_gimbal(angles)
    assert not LIMITS.past_gimbal(LIMITS.principal(angles))


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_between_two_configurations_hinges_take_the_shorter_way(share: float) -> None:
    here, other = np.full(55, 0.1), np.full(55, 0.5)
    here[7:], other[7:] = 7.0, 0.5
    target = np.where(np.isinf(LIMITS.high_rad), 0.5 + 2.0 * np.pi, 0.5)
    found = LIMITS.between(here, other, share)
    np.testing.assert_allclose(found, np.append(here[:7], (1.0 - share) * here[7:] + share * target))
