"""Forward kinematics and station Jacobians of the compiled tree against MuJoCo's."""

import numpy as np

from harness.body import Kinematics, build_body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.reconstruct.solver.kinematic_tree import (
    KinematicState,
    KinematicTree,
    build_tree,
    forward_kinematics,
    forward_kinematics_batch,
    new_state,
    station_jacobian,
)

BODY = build_body()
BONES = [BODY.skeleton.index(name) for name in ("head", "lhand", "rfoot", "lowerback", "lwrist")]


def posed(rng: np.random.Generator) -> tuple[Kinematics, KinematicTree, KinematicState, Floats]:
    """MuJoCo and the tree in the same random configuration, whose quaternion is not of unit length."""
    qpos = tpose(BODY.skeleton) + 0.4 * rng.normal(size=55)
    kinematics = Kinematics(BODY)
    kinematics.set(qpos)
    tree = build_tree(BODY, BONES, 0.1 * rng.normal(size=(len(BONES), 3)))
    forward_kinematics(tree, state := new_state(tree), qpos)
    return kinematics, tree, state, qpos


def test_poses_agree_with_mujoco(rng: np.random.Generator) -> None:
    kinematics, tree, state, qpos = posed(rng)
    joint_m, world_from_bone = kinematics.bone_poses()
    bodies = BODY.bone_body_ids - 1
    np.testing.assert_allclose(state.body_m[bodies], joint_m, atol=1e-12)
    assert np.max(rotations.angle_between_rad(state.world_from_body[bodies], world_from_bone)) < 1e-7
    station_m, _ = kinematics.station_poses(BONES, tree.mount_m, np.tile(rotations.IDENTITY, (len(BONES), 1)))
    np.testing.assert_allclose(state.station_m, station_m, atol=1e-12)
    batch_m, batch_from_bone = np.empty((2, len(BONES), 3)), np.empty((2, len(BONES), 4))
    forward_kinematics_batch(tree, new_state(tree), np.stack([qpos, qpos]), batch_m, batch_from_bone)
    np.testing.assert_array_equal(batch_m, [state.station_m] * 2)
    np.testing.assert_array_equal(batch_from_bone, [state.world_from_body[tree.station_body]] * 2)


def test_jacobians_agree_with_mujoco(rng: np.random.Generator) -> None:
    kinematics, tree, state, _ = posed(rng)
    linear, angular = np.zeros((2, len(BONES), 3, kinematics.nv))
    kinematics.jacobians(BONES, state.station_m, linear, angular)
    for station, last in enumerate(tree.station_dof):
        station_jacobian(tree, state, station)
        chain = tree.ancestors[last, : tree.depth[last] + 1]
        expected = np.concatenate([linear[station], angular[station]])
        np.testing.assert_allclose(state.jacobian[:, : len(chain)], expected[:, chain], atol=1e-12)
        assert not np.delete(expected, chain, axis=1).any()
