"""Where bones and trackers are, and how they move with the configuration."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from harness.body.humanoid import Body
from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton


class Kinematics:
    """One pose of a body at a time, fast: MuJoCo's kinematics and Jacobians. Not for sharing between threads."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.data: Any = mujoco.MjData(body.model)
        self.nv = int(body.model.nv)
        self._bodies = [int(body_id) for body_id in body.bone_body_ids]

    def set(self, qpos: Floats) -> None:
        """Take up a configuration (55,); the quaternion need not be of unit length."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.body.model, self.data)
        mujoco.mj_comPos(self.body.model, self.data)

    def bone_poses(self) -> tuple[Floats, Floats]:
        """Joints (24, 3) [m] and `world_from_bone` (24, 4)."""
        ids = self.body.bone_body_ids
        return self.data.xpos[ids], self.data.xquat[ids]

    def station_poses(
        self, bones: Sequence[int] | Ints, mount_m: Floats, bone_from_station: Floats
    ) -> tuple[Floats, Floats]:
        """Positions (S, 3) [m] and `world_from_station` (S, 4) of stations on these bones (S,)."""
        ids = self.body.bone_body_ids[np.asarray(bones)]
        reach_m = (self.data.xmat[ids].reshape(-1, 3, 3) @ mount_m[:, :, None])[:, :, 0]
        return self.data.xpos[ids] + reach_m, rotations.multiply(self.data.xquat[ids], bone_from_station)

    def jacobians(
        self,
        bones: Sequence[int] | Ints,
        point_m: Sequence[Floats] | Floats,
        linear: Sequence[Floats] | Floats,
        angular: Sequence[Floats] | Floats,
    ) -> None:
        """Fill in how points (S, 3) [m] fixed to these bones move: `linear` and `angular` (S, 3, nv), in world axes.

        Columns are MuJoCo's velocities: root velocity in world axes, root turn in the root's own, 48 hinges. Lists of
        the rows are quicker than arrays.
        """
        model, data, bodies = self.body.model, self.data, self._bodies
        for bone, at_m, slope, turn in zip(bones, point_m, linear, angular, strict=True):
            mujoco.mj_jac(model, data, slope, turn, at_m, bodies[bone])

    def integrate(self, qpos: Floats, step: Floats) -> Floats:
        """The configuration (55,) one tangent step (54,) from `qpos`."""
        out = np.array(qpos, dtype=float)
        mujoco.mj_integratePos(self.body.model, out, step, 1.0)
        return out

    def difference(self, start: Floats, stop: Floats) -> Floats:
        """The tangent step (54,) that `moved` takes from `start` to `stop`."""
        out = np.empty(self.nv)
        mujoco.mj_differentiatePos(self.body.model, out, 1.0, start, stop)
        return out


def pose_from_qpos(own: Skeleton, qpos: Floats) -> skeleton.Pose:
    """Forward kinematics of configurations (T, 55), in plain numpy."""
    return skeleton.forward_kinematics(own, *humanoid24.unpack(qpos))


def bone_poses(own: Skeleton, qpos: Floats) -> tuple[Floats, Floats]:
    """Joints (T, 24, 3) [m] and `world_from_bone` (T, 24, 4) of configurations (T, 55); signs continuous in time."""
    at = pose_from_qpos(own, qpos)
    return at.start_m, rotations.continuous(rotations.from_matrix(at.world_from_bone))


def joint_centres_m(own: Skeleton, qpos: Floats) -> Floats:
    """(T, 25, 3) the root, then the far end of each bone, of configurations (T, 55) [m]."""
    return np.concatenate([qpos[:, None, :3], pose_from_qpos(own, qpos).end_m], axis=1)
