"""A smooth trajectory with consistent pose, velocity and acceleration, and the motion of stations on it."""

from copy import copy
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.motion import BodyMotion
from harness.core.skeleton import Skeleton
from harness.errors import BadInput
from harness.simulate.calibration_motion import minimum_jerk
from harness.simulate.rest_pieces import (
    START_S,
    STOP_S,
    extend,
    start_piece,
    stop_piece,
    with_rest_after,
    with_rest_before,
)

OVERLAP_S = 0.05
"""Time for which a take goes on into its next round [s]: longer than what a device does at once."""
_RETURN_HZ, _LAST_REST_S = 120.0, 0.5
_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])


class StationMotion(NamedTuple):
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


class Trajectory:
    """Cubic spline through the frames of a take, twice continuously differentiable.

    The root's quaternion is interpolated with continuous sign and then normalised, which keeps two continuous
    derivatives. The take runs from 0 to `duration_s` [s]. `with_lead_in`, `with_lead_out` and `with_return` add motion
    before and after it, in which accelerations may jump. BadInput for times outside `begins_s` to `ends_s`.
    """

    def __init__(self, body: Body, take: BodyMotion) -> None:
        if len(take) < 2:
            raise BadInput(f"{take.name} has {len(take)} frame(s).", "A trajectory needs at least two.")
        self.body = body
        self.duration_s = take.duration_s
        knots = np.array(take.qpos)
        knots[:, 3:7] = rotations.continuous(knots[:, 3:7])
        self._take: PPoly = CubicSpline(np.arange(len(take)) / take.rate_hz, knots)
        self._spline: PPoly = self._take

    @property
    def spline(self) -> PPoly:
        """Cubic pieces (4, P, 55) of configurations, whose root quaternions are not normalised."""
        return self._spline

    @property
    def begins_s(self) -> float:
        """First time [s]: 0, or the beginning of the lead-in."""
        return float(self._spline.x[0])

    @property
    def ends_s(self) -> float:
        """Last time [s]: `duration_s`, or the end of what follows the take."""
        return float(self._spline.x[-1])

    def with_lead_in(self, warm_up_s: float) -> "Trajectory":
        """The trajectory from -`warm_up_s` [s], where the performer rests in the first pose, then starts to move.

        Position and velocity are continuous; the take stays as it is, to the bit. BadInput for a time that is not
        longer than the start (`rest_pieces.START_S`).
        """
        return self._with_spline(with_rest_before(self._spline, warm_up_s))

    def with_lead_out(self, rest_s: float) -> "Trajectory":
        """The trajectory until `rest_s` after its end [s]; the performer stops and rests in the last pose.

        Position and velocity are continuous. BadInput for a time that is not longer than the stop.
        """
        return self._with_spline(with_rest_after(self._spline, rest_s))

    def with_return(self, loop_s: float) -> "Trajectory":
        """The take and a way back to its first position and velocity, where it begins again at `loop_s` [s].

        The performer stops, goes back to the first pose in a minimum-jerk motion, and starts as in `with_lead_in`. The
        beginning of the take follows once more, for `OVERLAP_S`, and a stop. BadInput when the loop is too short.
        """
        from_s, to_s = self.duration_s + STOP_S, loop_s - START_S
        if not to_s > from_s:
            raise BadInput(
                f"A loop of {loop_s:.3f} s is too short for the take and the way back.",
                f"Stop and start take {STOP_S + START_S:g} s.",
            )
        back = _minimum_jerk_spline(self._take(self.duration_s), self._take(0.0), from_s, to_s)
        # The way back may end at the first pose with the opposite sign of its quaternion.
        sign = np.ones(self._take.c.shape[2])
        sign[3:7] = np.copysign(1.0, np.dot(back(to_s)[3:7], self._take(0.0)[3:7]))
        again = int(np.searchsorted(self._take.x[1:-1], OVERLAP_S)) + 1
        pieces = [stop_piece(self._take), back.c, sign * start_piece(self._take), sign * self._take.c[:, :again]]
        ends_s = np.concatenate([back.x, [loop_s], loop_s + self._take.x[1 : again + 1]])
        looped = extend(self._spline, np.concatenate(pieces, axis=1), ends_s)
        return self._with_spline(with_rest_after(looped, _LAST_REST_S))

    def _with_spline(self, spline: PPoly) -> "Trajectory":
        out = copy(self)
        out._spline = spline
        return out

    def qpos(self, time_s: Floats) -> Floats:
        """Configurations (N, 55) at N times [s]."""
        return self._derivatives(time_s, 0)[0]

    def qvel(self, time_s: Floats) -> Floats:
        """(N, 54) MuJoCo velocities: root velocity in world axes, root angular velocity in root axes, hinges."""
        return self._derivatives(time_s, 1)[1]

    def qacc(self, time_s: Floats) -> Floats:
        """(N, 54) time derivative of `qvel`."""
        return self._derivatives(time_s, 2)[2]

    def require_inside(self, time_s: Floats) -> None:
        """Raise BadInput unless all times lie between `begins_s` and `ends_s` [s]."""
        if time_s.size and not (time_s.min() >= self.begins_s - 1e-9 and time_s.max() <= self.ends_s + 1e-9):
            raise BadInput(
                f"A time between {time_s.min():.3f} and {time_s.max():.3f} s lies outside the take.",
                f"It runs from {self.begins_s:g} to {self.ends_s:.3f} s.",
            )

    def station_motion(self, calibration: Calibration, time_s: Floats) -> StationMotion:
        """True motion of S stations with the mounts of a calibration, station s at the N times `time_s[:, s]` [s]."""
        rows = [self._station_row(calibration, s, time_s[:, s]) for s in range(len(calibration.stations))]
        at_m, turned, speed, acceleration, omega = (np.stack(column, axis=1) for column in zip(*rows, strict=True))
        return StationMotion(time_s, at_m, rotations.continuous(turned), speed, acceleration, omega)

    def _derivatives(self, time_s: Floats, order: int, spline: PPoly | None = None) -> list[Floats]:
        """`qpos`, `qvel` and `qacc`, up to the given order; with `spline`, of the root and of its hinges alone."""
        t = np.asarray(time_s, dtype=float)
        self.require_inside(t)
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
        spline = _pieces(self._spline, time_s, columns)
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


class _PointMotion(NamedTuple):
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


def _minimum_jerk_spline(last: Floats, first: Floats, from_s: float, to_s: float) -> PPoly:
    """Cubic spline through a minimum-jerk motion between two configurations (55,), at rest at both ends."""
    count = int(np.ceil((to_s - from_s) * _RETURN_HZ)) + 1
    knots = minimum_jerk(last, first, np.linspace(0.0, 1.0, count + 1))
    knots[:, 3:7] = rotations.continuous(knots[:, 3:7])
    knots[-1] = first
    knots[-1, 3:7] *= np.copysign(1.0, np.dot(knots[-2, 3:7], first[3:7]))
    return CubicSpline(np.linspace(from_s, to_s, count + 1), knots, bc_type="clamped")


def _pieces(spline: PPoly, time_s: Floats, columns: list[int]) -> PPoly:
    """The pieces of a spline in which these times lie, of some columns alone."""
    if not time_s.size:
        return PPoly.construct_fast(spline.c[:, :1, columns], spline.x[:2])
    inner = spline.x[1:-1]
    first, last = np.searchsorted(inner, [time_s.min(), time_s.max()], side="right").tolist()
    return PPoly.construct_fast(spline.c[:, first : last + 1, columns], spline.x[first : last + 2])


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
