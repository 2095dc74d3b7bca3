"""Points carried by bones: where they are in a configuration, and how they move with it.

The fast path of the solvers: one MjData and preallocated arrays, one frame at a time.
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats


class CarriedPoints:
    """S points fixed to bones of one body. Not to be shared between threads: each call overwrites the arrays."""

    position_m: Floats
    """(S, 3) in the world."""
    world_from_bone: Floats
    """(S, 4) orientation of the bone that carries each."""
    jacobian: Floats
    """(6 S, 54) slope of all positions [m/m or m/rad], then of all rotations [rad/rad], both along world axes,
    against a step of the configuration as `moved` takes it."""

    def __init__(self, body: Body, bones: Sequence[str], bone_from_point_m: Floats) -> None:
        """Bones (S,) by name and points (S, 3) in their frames; UnknownName for a bone."""
        count = len(bones)
        self._model, self._data = body.model, mujoco.MjData(body.model)
        self._bodies = body.bone_body_ids[[body.skeleton.index(bone) for bone in bones]]
        self._point_m = np.ascontiguousarray(bone_from_point_m, dtype=float)[:, :, None]
        self._qpos = self._data.qpos
        self._body_m, self._turned, self._quaternion = self._data.xpos, self._data.xmat.reshape(-1, 3, 3), self._data.xquat
        self.position_m, self.world_from_bone = np.zeros((count, 3)), np.zeros((count, 4))
        self.jacobian = np.zeros((6 * count, body.model.nv))
        self._arm_m = np.zeros((count, 3, 1))
        self._slopes = [
            (self.jacobian[3 * i : 3 * i + 3], self.jacobian[3 * (count + i) : 3 * (count + i) + 3], self.position_m[i], b)
            for i, b in enumerate(self._bodies.tolist())
        ]

    def place(self, qpos: Floats) -> None:
        """Update positions and orientations to the configuration (55,)."""
        self._qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        np.matmul(self._turned[self._bodies], self._point_m, out=self._arm_m)
        np.add(self._body_m[self._bodies], self._arm_m[:, :, 0], out=self.position_m)
        np.take(self._quaternion, self._bodies, axis=0, out=self.world_from_bone)

    def differentiate(self) -> None:
        """Update the Jacobian to where `place` left the body."""
        mujoco.mj_comPos(self._model, self._data)
        for position_rows, rotation_rows, point_m, body in self._slopes:
            mujoco.mj_jac(self._model, self._data, position_rows, rotation_rows, point_m, body)

    def moved(self, qpos: Floats, step: Floats) -> Floats:
        """The configuration after a step (54,): root translation [m], root turn about its own axes [rad], hinges [rad]."""
        out: Floats = qpos.copy()
        mujoco.mj_integratePos(self._model, out, step, 1.0)
        return out
