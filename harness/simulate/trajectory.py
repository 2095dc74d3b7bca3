"""One smooth motion through a take's frames: pose, velocity and acceleration at any time, of the body and its trackers.

Root position and hinge angles are cubic splines, the root's orientation is scipy's RotationSpline; all are twice
continuously differentiable, so what an inertial sensor feels is defined everywhere.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import QPOS_OF_DOF, pack, unpack
from harness.core.motion import Take
from harness.errors import BadInput


@dataclass(frozen=True, eq=False)
class Moving:
    """A rigid thing at N instants, seen from the world."""

    position_m: Floats
    """(N, 3)"""
    world_from_it: Floats
    """(N, 3, 3)"""
    velocity_m_s: Floats
    """(N, 3)"""
    angular_rad_s: Floats
    """(N, 3), world axes."""
    acceleration_m_s2: Floats
    """(N, 3), gravity not included."""
    angular_rad_s2: Floats
    """(N, 3), world axes."""

    def at(self, offset_m: Floats) -> "Moving":
        """The same thing followed at a point (3,) or (N, 3) of its own frame [m]."""
        r = _apply(self.world_from_it, offset_m)
        w = self.angular_rad_s
        return replace(
            self,
            position_m=self.position_m + r,
            velocity_m_s=self.velocity_m_s + np.cross(w, r),
            acceleration_m_s2=self.acceleration_m_s2 + np.cross(self.angular_rad_s2, r) + np.cross(w, np.cross(w, r)),
        )

    def hinged(self, axis: Floats, angle_rad: Floats, rate_rad_s: Floats, growth_rad_s2: Floats) -> "Moving":
        """What hangs on it by a hinge through its origin, about `axis` (3,) of its frame."""
        axis_world = _apply(self.world_from_it, axis)
        turn = rate_rad_s[:, None] * axis_world
        growth = growth_rad_s2[:, None] * axis_world + np.cross(self.angular_rad_s, turn)
        return replace(
            self,
            world_from_it=self.world_from_it @ _about(axis, angle_rad),
            angular_rad_s=self.angular_rad_s + turn,
            angular_rad_s2=self.angular_rad_s2 + growth,
        )


class Trajectory:
    """The spline through a take; BadInput for fewer than four frames."""

    def __init__(self, body: Body, take: Take) -> None:
        if len(take) < 4:
            raise BadInput(f"{take.name} has {len(take)} frames.", "Replay needs four at least.")
        self.skeleton = body.skeleton
        self.duration_s = (len(take) - 1) / take.rate_hz
        known_s = np.arange(len(take)) / take.rate_hz
        root_m, world_from_root, angles_rad = unpack(take.qpos)
        self._root = CubicSpline(known_s, root_m)
        self._angles = CubicSpline(known_s, angles_rad)
        self._turn = RotationSpline(known_s, Rotation.from_quat(world_from_root, scalar_first=True))

    def qpos(self, time_s: Floats) -> Floats:
        """(N, 55) configurations."""
        turned = rotations.continuous(self._turn(time_s).as_quat(scalar_first=True))
        return pack(self._root(time_s), turned, self._angles(time_s))

    def qvel(self, time_s: Floats) -> Floats:
        """(N, 54) MuJoCo velocities: root linear in world axes, angular in the root's own, hinges."""
        return np.hstack([self._root(time_s, 1), self._turn(time_s, 1), self._angles(time_s, 1)[:, QPOS_OF_DOF]])

    def qacc(self, time_s: Floats) -> Floats:
        """(N, 54) their time derivatives."""
        return np.hstack([self._root(time_s, 2), self._turn(time_s, 2), self._angles(time_s, 2)[:, QPOS_OF_DOF]])

    def bone(self, name: str, time_s: Floats) -> Moving:
        """How a bone moves, followed at its joint."""
        chain, bone = [], self.skeleton.index(name)
        while bone >= 0:
            chain.append(bone)
            bone = self.skeleton.parents[bone]
        angles, rates, growths = (self._angles(time_s, order).T for order in (0, 1, 2))
        moving = self._moving_root(time_s)
        for k, bone in enumerate(reversed(chain)):
            if k:
                moving = moving.at(self.skeleton.bone_m[chain[-k]])
            where = self.skeleton.dof_of_bone[bone]
            for d in reversed(range(where.start, where.stop)):  # the last named hinge is the outermost
                moving = moving.hinged(self.skeleton.axes[d], angles[d], rates[d], growths[d])
        return moving

    def _moving_root(self, time_s: Floats) -> Moving:
        world_from_root = self._turn(time_s).as_matrix()
        return Moving(
            position_m=self._root(time_s),
            world_from_it=world_from_root,
            velocity_m_s=self._root(time_s, 1),
            angular_rad_s=_apply(world_from_root, self._turn(time_s, 1)),
            acceleration_m_s2=self._root(time_s, 2),
            angular_rad_s2=_apply(world_from_root, self._turn(time_s, 2)),
        )


def _apply(matrices: Floats, vectors: Floats) -> Floats:
    out: Floats = np.einsum("nij,nj->ni", matrices, np.broadcast_to(vectors, matrices.shape[:2]))
    return out


def _about(axis: Floats, angle_rad: Floats) -> Floats:
    """(N, 3, 3) Rodrigues' formula about one unit axis."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle_rad)[:, None, None], np.cos(angle_rad)[:, None, None]
    out: Floats = np.eye(3) + s * k + (1.0 - c) * (k @ k)
    return out
