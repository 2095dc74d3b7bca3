"""Poses and Jacobians of a body."""

import mujoco
import numpy as np
import pytest

from harness.body import humanoid, kinematics, mounts
from harness.body.kinematics import Kinematics
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from tests.body.conftest import random_qpos
from tests.joint_centres import joint_centres_m

STATIONS = tuple(mounts.DEFAULT_MOUNTS)


@pytest.fixture
def worn(lanky: Skeleton) -> tuple[Kinematics, list[int], Floats, Floats]:
    """Kinematics of a body with all stations, and the bones and mounts of these."""
    places = [mounts.locate_mount(lanky, mounts.DEFAULT_MOUNTS[s]) for s in STATIONS]
    bones = [lanky.index(mounts.DEFAULT_MOUNTS[s].bone) for s in STATIONS]
    body = humanoid.build_body(lanky, mounts.DEFAULT_MOUNTS.values())
    return Kinematics(body), bones, np.array([p for p, _ in places]), np.array([q for _, q in places])


Worn = tuple[Kinematics, list[int], Floats, Floats]


def test_stations_are_where_mujoco_has_their_sites(worn: Worn, rng: np.random.Generator) -> None:
    kin, bones, mount_m, bone_from_station = worn
    for qpos in random_qpos(rng, 10):
        kin.set(qpos)
        position_m, turn = kin.station_poses(bones, mount_m, bone_from_station)
        mujoco.mj_forward(kin.body.model, kin.data)
        for row, station in enumerate(STATIONS):
            np.testing.assert_allclose(position_m[row], kin.data.site(station).xpos, atol=1e-12)
            site = kin.data.site(station).xmat.reshape(3, 3)
            np.testing.assert_allclose(rotations.to_matrix(turn[row]), site, atol=1e-12)


def test_jacobians_are_the_slopes_of_station_poses(worn: Worn, rng: np.random.Generator) -> None:
    kin, bones, mount_m, bone_from_station = worn
    linear, angular = np.empty((2, len(bones), 3, kin.nv))
    step = 1e-6
    for qpos in random_qpos(rng, 4):
        kin.set(qpos)
        centre_m, _ = kin.station_poses(bones, mount_m, bone_from_station)
        kin.jacobians(bones, centre_m, linear, angular)
        for dof in range(kin.nv):
            ends = []
            for sign in (-1.0, 1.0):
                kin.set(kin.integrate(qpos, sign * step * np.eye(kin.nv)[dof]))
                ends.append(kin.station_poses(bones, mount_m, bone_from_station))
            (low_m, low), (high_m, high) = ends
            np.testing.assert_allclose((high_m - low_m) / (2 * step), linear[:, :, dof], atol=1e-8)
            turned = rotations.log(rotations.multiply(high, rotations.inverse(low))) / (2 * step)
            np.testing.assert_allclose(turned, angular[:, :, dof], atol=1e-7)


def test_difference_undoes_moved(worn: Worn, rng: np.random.Generator) -> None:
    kin = worn[0]
    for qpos in random_qpos(rng, 10):
        step = rng.normal(scale=0.3, size=kin.nv)
        np.testing.assert_allclose(kin.difference(qpos, kin.integrate(qpos, step)), step, atol=1e-9)


def test_whole_takes_agree_with_single_poses(worn: Worn, rng: np.random.Generator) -> None:
    kin = worn[0]
    own, qpos = kin.body.skeleton, random_qpos(rng, 12)
    joints_m, turns = kinematics.bone_poses(own, qpos)
    centres_m = joint_centres_m(own, qpos)
    assert centres_m.shape == (12, 25, 3)
    for frame, configuration in enumerate(qpos):
        kin.set(configuration)
        joint_m, turn = kin.bone_poses()
        np.testing.assert_allclose(joints_m[frame], joint_m, atol=1e-12)
        assert float(np.max(rotations.angle_between_rad(turns[frame], turn))) < 1e-7
        np.testing.assert_allclose(centres_m[frame, 0], configuration[:3], atol=1e-15)
        ends_m = joint_m + rotations.rotate(turn, own.bone_m)
        np.testing.assert_allclose(centres_m[frame, 1:], ends_m, atol=1e-12)


def test_poses_taken_out_do_not_change_later(worn: Worn, rng: np.random.Generator) -> None:
    kin, (first, second) = worn[0], random_qpos(rng, 2)
    kin.set(first)
    joint_m, turn = kin.bone_poses()
    kept = joint_m.copy(), turn.copy()
    kin.set(second)
    np.testing.assert_array_equal(joint_m, kept[0])
    np.testing.assert_array_equal(turn, kept[1])
