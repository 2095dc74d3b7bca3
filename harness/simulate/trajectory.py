"""One smooth motion for pose, velocity and acceleration alike, and where the trackers on it are at any moment."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from harness.body import mounts
from harness.body.humanoid import Body
from harness.body.mounts import Mount
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.humanoid24 import unpack
from harness.core.motion import Take
from harness.core.skeleton import Skeleton
from harness.errors import BadInput


@dataclass(frozen=True, eq=False)
class StationMotion:
    """How S stations truly move, each at its own N moments; world axes."""

    time_s: Floats
    """(N, S) [s]"""
    position_m: Floats
    """(N, S, 3) [m]"""
    world_from_station: Floats
    """(N, S, 4) unit quaternions, signs continuous in time."""
    velocity_m_s: Floats
    """(N, S, 3)"""
    acceleration_m_s2: Floats
    """(N, S, 3)"""
    turn_rad_s: Floats
    """(N, S, 3) angular velocity [rad/s]."""

    def __post_init__(self) -> None:
        freeze(self, time_s=("N", "S"), world_from_station=("N", "S", 4))
        vector = (*self.time_s.shape, 3)
        freeze(self, position_m=vector, velocity_m_s=vector, acceleration_m_s2=vector, turn_rad_s=vector)


class Trajectory:
    """A take between its frames: twice continuously differentiable, through every frame.

    A cubic spline of the configuration; the root's quaternion is splined with continuous sign and brought to unit
    length afterwards, which keeps two continuous derivatives. Time runs from 0 to `duration_s`; BadInput outside.
    """

    def __init__(self, body: Body, take: Take) -> None:
        if len(take) < 2:
            raise BadInput(f"{take.name} has {len(take)} frame(s).", "A trajectory needs two at least.")
        self.body = body
        self.duration_s = (len(take) - 1) / take.rate_hz
        knots = np.array(take.qpos)
        knots[:, 3:7] = rotations.continuous(knots[:, 3:7])
        self._spline = CubicSpline(np.arange(len(take)) / take.rate_hz, knots)

    def qpos(self, time_s: Floats) -> Floats:
        """Configurations (N, 55) at N moments [s]."""
        out = self._at(time_s, 0)
        out[:, 3:7] /= _norm(out[:, 3:7])
        return out

    def qvel(self, time_s: Floats) -> Floats:
        """(N, 54) as MuJoCo has it: root velocity in the world, root turn in the root's own axes, hinges."""
        p, v = self._at(time_s, 0)[:, 3:7], self._at(time_s, 1)
        n = _norm(p)
        turn = 2.0 * rotations.multiply(rotations.inverse(p / n), v[:, 3:7] / n)[:, 1:]
        return np.concatenate([v[:, :3], turn, v[:, 7:]], axis=1)

    def qacc(self, time_s: Floats) -> Floats:
        """(N, 54), the time derivative of `qvel`."""
        p, v, a = self._at(time_s, 0)[:, 3:7], self._at(time_s, 1)[:, 3:7], self._at(time_s, 2)
        n = _norm(p)
        # With q = p/n the part of q'' along p is of no effect: conj(q) p is a pure scalar; so is conj(q') q'.
        bend = a[:, 3:7] / n - 2.0 * v * np.sum(p * v, axis=1, keepdims=True) / n**3
        turn = 2.0 * rotations.multiply(rotations.inverse(p / n), bend)[:, 1:]
        return np.concatenate([a[:, :3], turn, a[:, 7:]], axis=1)

    def station_motion(self, worn: Sequence[Mount], time_s: Floats) -> StationMotion:
        """True motion of S stations, station s at the N moments `time_s[:, s]` (N, S)."""
        skeleton = self.body.skeleton
        rows = [_of_station(skeleton, mount, self, time_s[:, s]) for s, mount in enumerate(worn)]
        position, turned, velocity, acceleration, turn = (
            np.stack(column, axis=1) for column in zip(*rows, strict=True)
        )
        return StationMotion(time_s, position, rotations.continuous(turned), velocity, acceleration, turn)

    def _at(self, time_s: Floats, order: int) -> Floats:
        t = np.asarray(time_s, dtype=float)
        if t.size and not (t.min() >= -1e-9 and t.max() <= self.duration_s + 1e-9):
            raise BadInput(
                f"A moment between {t.min():.3f} and {t.max():.3f} s lies outside the take.",
                f"It runs from 0 to {self.duration_s:.3f} s.",
            )
        out: Floats = self._spline(t, order)
        return out


def _of_station(
    skeleton: Skeleton, mount: Mount, trajectory: Trajectory, time_s: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Position, orientation, velocity, acceleration and angular velocity of one station, passed on from bone to bone."""
    q, v, a = trajectory.qpos(time_s), trajectory.qvel(time_s), trajectory.qacc(time_s)
    root_m, root, angle = unpack(q)
    _, _, rate = unpack(np.insert(v, 3, 0.0, axis=1))
    _, _, surge = unpack(np.insert(a, 3, 0.0, axis=1))
    turned = rotations.to_matrix(root)
    at, speed, thrust = root_m, v[:, :3], a[:, :3]
    omega, alpha = _apply(turned, v[:, 3:6]), _apply(turned, a[:, 3:6])
    chain = _chain(skeleton, mount.bone)
    for bone in chain:
        hinges = skeleton.dof_of_bone[bone]
        for d in range(hinges.stop - 1, hinges.start - 1, -1):
            axis = turned @ skeleton.axes[d]
            alpha = alpha + surge[:, d, None] * axis + rate[:, d, None] * np.cross(omega, axis)
            omega = omega + rate[:, d, None] * axis
            turned = turned @ _about(skeleton.axes[d], angle[:, d])
        if bone != chain[-1]:
            at, speed, thrust = _carried(turned @ skeleton.bone_m[bone], at, speed, thrust, omega, alpha)
    mount_m, bone_from_station = mounts.place(skeleton, mount)
    at, speed, thrust = _carried(turned @ mount_m, at, speed, thrust, omega, alpha)
    return at, rotations.from_matrix(turned @ rotations.to_matrix(bone_from_station)), speed, thrust, omega


def _chain(skeleton: Skeleton, bone: str) -> list[int]:
    """The bones from the root to `bone`."""
    chain = [skeleton.index(bone)]
    while (parent := skeleton.parents[chain[0]]) >= 0:
        chain.insert(0, parent)
    return chain


def _carried(
    reach_m: Floats, at: Floats, speed: Floats, thrust: Floats, omega: Floats, alpha: Floats
) -> tuple[Floats, Floats, Floats]:
    """Position, velocity and acceleration of a point `reach_m` (N, 3) away on the same rigid bone."""
    swing = np.cross(omega, reach_m)
    return at + reach_m, speed + swing, thrust + np.cross(alpha, reach_m) + np.cross(omega, swing)


def _about(axis: Floats, angle_rad: Floats) -> Floats:
    """Rotation matrices (N, 3, 3) about one unit axis, by Rodrigues' formula."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle_rad)[:, None, None] * k + (1.0 - np.cos(angle_rad))[:, None, None] * (k @ k)


def _apply(matrices: Floats, vectors: Floats) -> Floats:
    out: Floats = np.einsum("nij,nj->ni", matrices, vectors)
    return out


def _norm(rows: Floats) -> Floats:
    out: Floats = np.sqrt(np.sum(rows**2, axis=1, keepdims=True))
    return out
