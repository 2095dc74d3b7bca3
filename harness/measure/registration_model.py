"""Model of what registered stations report, with its derivatives.

At device time d = t + offset + ratio (t - reference_s), for the true time t, station s reports

    orientation  exp(heading z) R B(t) Y_s
    position     p(t) + ahead p'(t), p(t) = (1 + scale) R (b(t) + B(t) m_s - o)

with the pose (b, B) of its body in the world, room R = `tracker_from_world` and origin o, and mount (m_s, Y_s). The
heading error turns orientations about the tracker's vertical. The position's error along the velocity is linear, as
in `components.speed`; a shift in time would bend it, and change the scale of fast motion.
"""

from dataclasses import dataclass, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.measure.pose_series import TruthSpline

SHARED = 11
"""Number of parameters that all stations share; each station adds `OWN` for its mount."""
OWN = 6
ROOM_TURN, ROOM_ORIGIN = slice(0, 3), slice(3, 6)
SCALE, HEADING, OFFSET, AHEAD, CLOCK = 6, 7, 8, 9, 10
_STEP_S = 1e-3
"""Step of the difference that gives accelerations [s]."""


@dataclass(frozen=True, eq=False)
class RegistrationState:
    """Values of all parameters for S stations."""

    reference_s: float
    """Time of the reference's clock to which the offsets belong [s]."""
    tracker_from_world: Floats
    """(4,) unit quaternion."""
    tracker_origin_m: Floats
    """(3,) origin of the tracker's frame in the world [m]."""
    scale: float
    heading_rad: float
    offset_s: float
    """Device's clock minus that of the reference, by which orientations agree [s]."""
    ahead_s: float
    """Time by which positions run ahead of orientations [s]."""
    clock_ratio: float
    """Rate error of the device's clock; positive runs fast."""
    body_from_station: Floats
    """(S, 4) unit quaternions."""
    mount_m: Floats
    """(S, 3) position of each station in the frame of its body [m]."""

    def __post_init__(self) -> None:
        freeze(self, tracker_from_world=(4,), tracker_origin_m=(3,))
        freeze(self, body_from_station=("S", 4), mount_m=("S", 3))

    def truth_time_s(self, measured_s: Floats) -> Floats:
        """True times of readings by their device times, both (N,) [s]."""
        out: Floats = self.reference_s + (measured_s - self.reference_s - self.offset_s) / (1.0 + self.clock_ratio)
        return out

    def moved(self, step: Floats) -> "RegistrationState":
        """The state after a step (11 + 6 S,) of all parameters."""
        own = step[SHARED:].reshape(-1, OWN)
        return replace(
            self,
            tracker_from_world=_unit(rotations.multiply(rotations.exp(step[ROOM_TURN]), self.tracker_from_world)),
            tracker_origin_m=self.tracker_origin_m + step[ROOM_ORIGIN],
            scale=self.scale + float(step[SCALE]),
            heading_rad=self.heading_rad + float(step[HEADING]),
            offset_s=self.offset_s + float(step[OFFSET]),
            ahead_s=self.ahead_s + float(step[AHEAD]),
            clock_ratio=self.clock_ratio + float(step[CLOCK]),
            body_from_station=_unit(rotations.multiply(rotations.exp(own[:, :3]), self.body_from_station)),
            mount_m=self.mount_m + own[:, 3:],
        )


def linearise(
    state: RegistrationState, station: int, measured_s: Floats, position_m: Floats, turn: Floats, truth: TruthSpline
) -> tuple[Floats, Floats]:
    """Linearise the model of one station at its records: device times (N,), positions (N, 3), quaternions (N, 4).

    Returns residuals (N, 6), reported minus modelled: position [m], then rotation vector in the tracker's axes [rad];
    and derivatives (N, 6, 17) of the modelled values by 11 shared parameters, then 6 of the mount.
    """
    count = len(measured_s)
    room, mount_m, mount = state.tracker_from_world, state.mount_m[station], state.body_from_station[station]
    rate = 1.0 / (1.0 + state.clock_ratio)
    residual, slope = np.zeros((count, 6)), np.zeros((count, 6, SHARED + OWN))

    time_s = state.truth_time_s(measured_s)
    since_s = (time_s - state.reference_s)[:, None]
    factor = 1.0 + state.scale
    body_m, body, omega, velocity = _station_motion(mount_m, time_s, truth)
    ahead, behind = (_station_motion(mount_m, time_s + step_s, truth)[3] for step_s in (_STEP_S, -_STEP_S))
    acceleration = (ahead - behind) / (2.0 * _STEP_S)
    at_m = body_m + rotations.rotate(body, mount_m) - state.tracker_origin_m + state.ahead_s * velocity
    arm = rotations.to_matrix(body) + state.ahead_s * rotations.to_matrix(body) @ rotations.cross_matrix(omega)
    in_room = rotations.rotate(room, at_m)
    by_time = factor * rotations.rotate(room, velocity + state.ahead_s * acceleration)
    residual[:, :3] = position_m - factor * in_room
    slope[:, :3, ROOM_TURN] = -factor * rotations.cross_matrix(in_room)
    slope[:, :3, ROOM_ORIGIN] = -factor * rotations.to_matrix(room)
    slope[:, :3, SCALE] = in_room
    slope[:, :3, OFFSET] = -rate * by_time
    slope[:, :3, AHEAD] = factor * rotations.rotate(room, velocity)
    slope[:, :3, CLOCK] = -rate * by_time * since_s
    slope[:, :3, SHARED + 3 :] = factor * rotations.to_matrix(room) @ arm

    headed = rotations.multiply(rotations.about_z(state.heading_rad), room)
    in_tracker = rotations.multiply(headed, body)
    modelled = rotations.multiply(in_tracker, mount)
    rate_rad_s = rotations.rotate(in_tracker, omega)
    residual[:, 3:] = rotations.log(rotations.multiply(turn, rotations.inverse(modelled)))
    slope[:, 3:, ROOM_TURN] = rotations.to_matrix(rotations.about_z(state.heading_rad))
    slope[:, 5, HEADING] = 1.0
    slope[:, 3:, OFFSET] = -rate * rate_rad_s
    slope[:, 3:, CLOCK] = -rate * rate_rad_s * since_s
    slope[:, 3:, SHARED : SHARED + 3] = rotations.to_matrix(in_tracker)
    return residual, slope


def _station_motion(mount_m: Floats, time_s: Floats, truth: TruthSpline) -> tuple[Floats, Floats, Floats, Floats]:
    """Position, quaternion and angular velocity of the body, and velocity of the station (N, 3) in world axes [m/s]."""
    body_m, body, velocity, omega = truth.motion(time_s)
    return body_m, body, omega, velocity + rotations.rotate(body, rotations.cross(omega, mount_m))


def _unit(quaternion: Floats) -> Floats:
    out: Floats = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    return out
