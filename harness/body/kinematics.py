"""Forward kinematics of bones and stations, and their Jacobians."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.body.humanoid import Body
from harness.core import humanoid24, rotations
from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Pose, Skeleton, forward_kinematics
from harness.core.working_folder import plain_import

with plain_import():
    import mujoco


class Kinematics:
    """MuJoCo's kinematics and Jacobians of a body, one configuration at a time. For one thread only."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.data: Any = mujoco.MjData(body.model)
        self.nv = int(body.model.nv)
        self._bodies = [int(body_id) for body_id in body.bone_body_ids]

    def set(self, qpos: Floats) -> None:
        """Set the configuration (55,); its quaternion need not have unit length."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.body.model, self.data)
        mujoco.mj_comPos(self.body.model, self.data)

    def bone_poses(self) -> tuple[Floats, Floats]:
        """Joint positions (24, 3) [m] and `world_from_bone` (24, 4)."""
        ids = self.body.bone_body_ids
        return self.data.xpos[ids], self.data.xquat[ids]

    def station_poses(
        self, bones: Sequence[int] | Ints, mount_m: Floats, bone_from_station: Floats
    ) -> tuple[Floats, Floats]:
        """Positions (S, 3) [m] and `world_from_station` (S, 4) of stations.

        `bones` (S,) are the indices of their bones, `mount_m` (S, 3) [m] and `bone_from_station` (S, 4) their mounts.
        """
        ids = self.body.bone_body_ids[np.asarray(bones)]
        offset_m = (self.data.xmat[ids].reshape(-1, 3, 3) @ mount_m[:, :, None])[:, :, 0]
        return self.data.xpos[ids] + offset_m, rotations.multiply(self.data.xquat[ids], bone_from_station)

    def jacobians(
        self,
        bones: Sequence[int] | Ints,
        point_m: Sequence[Floats] | Floats,
        linear: Sequence[Floats] | Floats,
        angular: Sequence[Floats] | Floats,
    ) -> None:
        """Fill in the Jacobians `linear` and `angular` (S, 3, nv), in world axes, of points (S, 3) [m] fixed to bones.

        Columns are MuJoCo's velocities: root velocity in world axes, root angular velocity in the root's axes, 48
        hinges. Lists of rows are faster than arrays.
        """
        model, data, bodies = self.body.model, self.data, self._bodies
        for bone, point, translation, rotation in zip(bones, point_m, linear, angular, strict=True):
            mujoco.mj_jac(model, data, translation, rotation, point, bodies[bone])

    def integrate(self, qpos: Floats, step: Floats) -> Floats:
        """The configuration (55,) after one tangent step (54,) from `qpos`."""
        out = np.array(qpos, dtype=float)
        mujoco.mj_integratePos(self.body.model, out, step, 1.0)
        return out

    def difference(self, start: Floats, stop: Floats) -> Floats:
        """The tangent step (54,) by which `integrate` goes from `start` to `stop`."""
        out = np.empty(self.nv)
        mujoco.mj_differentiatePos(self.body.model, out, 1.0, start, stop)
        return out


def pose_from_qpos(skeleton: Skeleton, qpos: Floats) -> Pose:
    """Forward kinematics of configurations (T, 55), in numpy."""
    return forward_kinematics(skeleton, *humanoid24.unpack(qpos))


def bone_poses(skeleton: Skeleton, qpos: Floats) -> tuple[Floats, Floats]:
    """Joint positions (T, 24, 3) [m] and `world_from_bone` (T, 24, 4) of configurations (T, 55), signs continuous."""
    pose = pose_from_qpos(skeleton, qpos)
    return pose.start_m, rotations.continuous(rotations.from_matrix(pose.world_from_bone))
