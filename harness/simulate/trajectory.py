"""One smooth motion for pose, velocity and acceleration alike, and where the trackers on it are at any moment."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.core.humanoid24 import QPOS_OF_DOF, unpack
from harness.core.motion import BodyMotion
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

    def __init__(self, body: Body, take: BodyMotion) -> None:
        if len(take) < 2:
            raise BadInput(f"{take.name} has {len(take)} frame(s).", "A trajectory needs two at least.")
        self.body = body
        self.duration_s = (len(take) - 1) / take.rate_hz
        knots = np.array(take.qpos)
        knots[:, 3:7] = rotations.continuous(knots[:, 3:7])
        self._spline = CubicSpline(np.arange(len(take)) / take.rate_hz, knots)

    def qpos(self, time_s: Floats) -> Floats:
        """Configurations (N, 55) at N moments [s]."""
        return self._derivatives(time_s, 0)[0]

    def qvel(self, time_s: Floats) -> Floats:
        """(N, 54) as MuJoCo has it: root velocity in the world, root turn in the root's own axes, hinges."""
        return self._derivatives(time_s, 1)[1]

    def qacc(self, time_s: Floats) -> Floats:
        """(N, 54), the time derivative of `qvel`."""
        return self._derivatives(time_s, 2)[2]

    def station_motion(self, worn: Calibration, time_s: Floats) -> StationMotion:
        """True motion of S stations that are worn like this, station s at the N moments `time_s[:, s]` (N, S)."""
        rows = [self._of_station(worn, s, time_s[:, s]) for s in range(len(worn.stations))]
        at_m, turned, speed, thrust, omega = (np.stack(column, axis=1) for column in zip(*rows, strict=True))
        return StationMotion(time_s, at_m, rotations.continuous(turned), speed, thrust, omega)

    def _derivatives(self, time_s: Floats, order: int) -> list[Floats]:
        """`qpos`, `qvel` and `qacc`, as far as the order of the derivative asked for."""
        t = np.asarray(time_s, dtype=float)
        if t.size and not (t.min() >= -1e-9 and t.max() <= self.duration_s + 1e-9):
            raise BadInput(
                f"A moment between {t.min():.3f} and {t.max():.3f} s lies outside the take.",
                f"It runs from 0 to {self.duration_s:.3f} s.",
            )
        splined: list[Floats] = [self._spline(t, k) for k in range(order + 1)]
        # Let p be the splined quaternion, n its length, q = p/n. What q' and q'' have along q is of no effect on the
        # turn 2 conj(q) q' and its derivative 2 conj(q) q'': conj(q) q and conj(q') q' are pure scalars.
        p = splined[0][:, 3:7]
        n = np.sqrt(np.sum(p**2, axis=1, keepdims=True))
        q = p / n
        out = [np.concatenate([splined[0][:, :3], q, splined[0][:, 7:]], axis=1)]
        for k, at in enumerate(splined[1:]):
            slope = at[:, 3:7] / n
            if k == 1:
                slope = slope - 2.0 * splined[1][:, 3:7] / n * np.sum(q * splined[1][:, 3:7], axis=1, keepdims=True) / n
            turn = 2.0 * rotations.multiply(rotations.inverse(q), slope)[:, 1:]
            out.append(np.concatenate([at[:, :3], turn, at[:, 7:]], axis=1))
        return out

    def _of_station(self, worn: Calibration, row: int, time_s: Floats) -> tuple[Floats, ...]:
        """Position, orientation, velocity, acceleration and angular velocity, passed on from bone to bone."""
        skeleton = self.body.skeleton
        q, v, a = self._derivatives(time_s, 2)
        at, turned, angle = unpack(q)
        rate, surge = v[:, 6:][:, QPOS_OF_DOF], a[:, 6:][:, QPOS_OF_DOF]
        point = _PointMotion(at, v[:, :3], a[:, :3])
        omega, alpha = rotations.rotate(turned, v[:, 3:6]), rotations.rotate(turned, a[:, 3:6])
        chain = _chain(skeleton, worn.bones[row])
        for bone in chain:
            hinges = skeleton.dof_of_bone[bone]
            for d in range(hinges.stop - 1, hinges.start - 1, -1):
                axis = rotations.rotate(turned, skeleton.axes[d])
                alpha = alpha + surge[:, d, None] * axis + rate[:, d, None] * _cross(omega, axis)
                omega = omega + rate[:, d, None] * axis
                turned = rotations.multiply(turned, rotations.exp(angle[:, d, None] * skeleton.axes[d]))
            if bone != chain[-1]:
                point = point.carried(rotations.rotate(turned, skeleton.bone_m[bone]), omega, alpha)
        point = point.carried(rotations.rotate(turned, worn.mount_m[row]), omega, alpha)
        station = rotations.multiply(turned, worn.bone_from_station[row])
        return point.at_m, station, point.velocity, point.acceleration, omega


@dataclass(frozen=True, eq=False)
class _PointMotion:
    """Of a point on a rigid bone: place, velocity and acceleration, (N, 3) each."""

    at_m: Floats
    velocity: Floats
    acceleration: Floats

    def carried(self, reach_m: Floats, omega: Floats, alpha: Floats) -> "_PointMotion":
        """The same of the point `reach_m` (N, 3) away on the same bone, which turns by `omega` and `alpha`."""
        swing = _cross(omega, reach_m)
        return _PointMotion(
            self.at_m + reach_m,
            self.velocity + swing,
            self.acceleration + _cross(alpha, reach_m) + _cross(omega, swing),
        )


def _chain(skeleton: Skeleton, bone: str) -> list[int]:
    """The bones from the root to `bone`."""
    chain = [skeleton.index(bone)]
    while (parent := skeleton.parents[chain[0]]) >= 0:
        chain.insert(0, parent)
    return chain


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products (N, 3); numpy's own is slow on short rows."""
    out: Floats = a[:, _NEXT] * b[:, _AFTER] - a[:, _AFTER] * b[:, _NEXT]
    return out


_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])
