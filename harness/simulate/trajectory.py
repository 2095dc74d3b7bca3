"""A smooth trajectory with consistent pose, velocity and acceleration, and the motion of stations on it."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.motion import BodyMotion
from harness.core.skeleton import Skeleton
from harness.errors import BadInput


@dataclass(frozen=True, eq=False)
class StationMotion:
    """True motion of S stations, each at its own N times; world axes."""

    time_s: Floats
    """(N, S) times [s]."""
    position_m: Floats
    """(N, S, 3) positions [m]."""
    world_from_station: Floats
    """(N, S, 4) unit quaternions, signs continuous in time."""
    velocity_m_s: Floats
    """(N, S, 3) velocities [m/s]."""
    acceleration_m_s2: Floats
    """(N, S, 3) accelerations [m/s^2]."""
    turn_rad_s: Floats
    """(N, S, 3) angular velocities [rad/s]."""

    def __post_init__(self) -> None:
        freeze(self, time_s=("N", "S"), world_from_station=("N", "S", 4))
        vector = (*self.time_s.shape, 3)
        freeze(self, position_m=vector, velocity_m_s=vector, acceleration_m_s2=vector, turn_rad_s=vector)


class Trajectory:
    """Cubic spline through the frames of a take, twice continuously differentiable.

    The root's quaternion is interpolated with continuous sign and then normalised, which keeps two continuous
    derivatives. Time runs from 0 to `duration_s` [s]; BadInput outside.
    """

    def __init__(self, body: Body, take: BodyMotion) -> None:
        if len(take) < 2:
            raise BadInput(f"{take.name} has {len(take)} frame(s).", "A trajectory needs at least two.")
        self.body = body
        self.duration_s = (len(take) - 1) / take.rate_hz
        knots = np.array(take.qpos)
        knots[:, 3:7] = rotations.continuous(knots[:, 3:7])
        self._spline = CubicSpline(np.arange(len(take)) / take.rate_hz, knots)

    def qpos(self, time_s: Floats) -> Floats:
        """Configurations (N, 55) at N times [s]."""
        return self._derivatives(time_s, 0)[0]

    def qvel(self, time_s: Floats) -> Floats:
        """(N, 54) MuJoCo velocities: root velocity in world axes, root angular velocity in root axes, hinges."""
        return self._derivatives(time_s, 1)[1]

    def qacc(self, time_s: Floats) -> Floats:
        """(N, 54) time derivative of `qvel`."""
        return self._derivatives(time_s, 2)[2]

    def station_motion(self, calibration: Calibration, time_s: Floats) -> StationMotion:
        """True motion of S stations with the mounts of a calibration, station s at the N times `time_s[:, s]` [s]."""
        rows = [self._station_row(calibration, s, time_s[:, s]) for s in range(len(calibration.stations))]
        at_m, turned, speed, acceleration, omega = (np.stack(column, axis=1) for column in zip(*rows, strict=True))
        return StationMotion(time_s, at_m, rotations.continuous(turned), speed, acceleration, omega)

    def _derivatives(self, time_s: Floats, order: int, spline: PPoly | None = None) -> list[Floats]:
        """`qpos`, `qvel` and `qacc`, up to the given order; with `spline`, of the root and of its hinges alone."""
        t = np.asarray(time_s, dtype=float)
        if t.size and not (t.min() >= -1e-9 and t.max() <= self.duration_s + 1e-9):
            raise BadInput(
                f"A time between {t.min():.3f} and {t.max():.3f} s lies outside the take.",
                f"It runs from 0 to {self.duration_s:.3f} s.",
            )
        splined: list[Floats] = [(spline or self._spline)(t, k) for k in range(order + 1)]
        # Let p be the splined quaternion, n its length, q = p/n. Components of q' and q'' along q do not change the
        # angular velocity 2 conj(q) q' and its derivative 2 conj(q) q'': conj(q) q and conj(q') q' are scalars.
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

    def _station_row(self, calibration: Calibration, row: int, time_s: Floats) -> tuple[Floats, ...]:
        """Position, orientation, velocity, acceleration and angular velocity of a station, from bone to bone."""
        skeleton = self.body.skeleton
        chain = _chain(skeleton, calibration.bones[row])
        hinges_of = [
            range(where.stop - 1, where.start - 1, -1) for where in map(skeleton.dof_of_bone.__getitem__, chain)
        ]
        hinges = [d for own in hinges_of for d in own]
        columns = [*range(7), *(7 + QPOS_OF_DOF[hinges])]  # other hinges do not move the station
        spline = PPoly.construct_fast(self._spline.c[:, :, columns], self._spline.x)
        q, v, a = self._derivatives(time_s, 2, spline)
        turned, rate, hinge_acceleration = q[:, 3:7], v[:, 6:, None], a[:, 6:, None]
        turns = rotations.exp(q[:, 7:, None] * skeleton.axes[hinges])
        point = _PointMotion(q[:, :3], v[:, :3], a[:, :3])
        omega, alpha = rotations.rotate(turned, v[:, 3:6]), rotations.rotate(turned, a[:, 3:6])
        place = 0
        for bone, own in zip(chain, hinges_of, strict=True):
            for d in own:
                axis = rotations.rotate(turned, skeleton.axes[d])
                alpha = alpha + hinge_acceleration[:, place] * axis + rate[:, place] * _cross(omega, axis)
                omega = omega + rate[:, place] * axis
                turned = rotations.multiply(turned, turns[:, place])
                place += 1
            if bone != chain[-1]:
                point = point.at_offset(rotations.rotate(turned, skeleton.bone_m[bone]), omega, alpha)
        point = point.at_offset(rotations.rotate(turned, calibration.mount_m[row]), omega, alpha)
        station = rotations.multiply(turned, calibration.bone_from_station[row])
        return point.at_m, station, point.velocity, point.acceleration, omega


@dataclass(frozen=True, eq=False)
class _PointMotion:
    """Position, velocity and acceleration of a point on a rigid bone, (N, 3) each."""

    at_m: Floats
    velocity: Floats
    acceleration: Floats

    def at_offset(self, reach_m: Floats, omega: Floats, alpha: Floats) -> "_PointMotion":
        """Motion of the point `reach_m` (N, 3) away on the same bone, with angular velocity and acceleration given."""
        swing = _cross(omega, reach_m)
        return _PointMotion(
            self.at_m + reach_m,
            self.velocity + swing,
            self.acceleration + _cross(alpha, reach_m) + _cross(omega, swing),
        )


def _chain(skeleton: Skeleton, bone: str) -> list[int]:
    """Indices of the bones from the root to `bone`."""
    chain = [skeleton.index(bone)]
    while (parent := skeleton.parents[chain[0]]) >= 0:
        chain.insert(0, parent)
    return chain


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products (N, 3); `np.cross` is slow on short rows."""
    out: Floats = a[:, _NEXT] * b[:, _AFTER] - a[:, _AFTER] * b[:, _NEXT]
    return out


_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])
