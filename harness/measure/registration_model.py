"""Model of what registered stations report, with its derivatives.

At device time `d` station s reports, for the true time `t` of each kind of reading,

    position     (1 + scale) R (b(t_p) + B(t_p) m_s - o)
    orientation  exp(heading z) R B(t_o) Y_s

with the pose (b, B) of its body in the world, room R = `tracker_from_world` and origin o, mount (m_s, Y_s), and
d = t + offset + ratio (t - reference_s). Orientation and position have an offset each; the heading error turns
orientations about the tracker's vertical.
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
SCALE, HEADING, OFFSET_ORIENTATION, OFFSET_POSITION, CLOCK = 6, 7, 8, 9, 10


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
    offset_orientation_s: float
    offset_position_s: float
    clock_ratio: float
    """Rate error of the device's clock; positive runs fast."""
    body_from_station: Floats
    """(S, 4) unit quaternions."""
    mount_m: Floats
    """(S, 3) position of each station in the frame of its body [m]."""

    def __post_init__(self) -> None:
        freeze(self, tracker_from_world=(4,), tracker_origin_m=(3,))
        freeze(self, body_from_station=("S", 4), mount_m=("S", 3))

    def truth_time_s(self, measured_s: Floats, *, of_position: bool) -> Floats:
        """True times of readings by their device times, both (N,) [s]."""
        offset_s = self.offset_position_s if of_position else self.offset_orientation_s
        out: Floats = self.reference_s + (measured_s - self.reference_s - offset_s) / (1.0 + self.clock_ratio)
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
            offset_orientation_s=self.offset_orientation_s + float(step[OFFSET_ORIENTATION]),
            offset_position_s=self.offset_position_s + float(step[OFFSET_POSITION]),
            clock_ratio=self.clock_ratio + float(step[CLOCK]),
            body_from_station=_unit(rotations.multiply(rotations.exp(own[:, :3]), self.body_from_station)),
            mount_m=self.mount_m + own[:, 3:],
        )


@dataclass(frozen=True, eq=False)
class Linearised:
    """Residuals of one station's N records, and their derivatives by the shared and the station's own parameters."""

    residual: Floats
    """(N, 6) reported minus modelled: position [m], then rotation vector in the tracker's axes [rad]."""
    slope: Floats
    """(N, 6, 17) derivative of the modelled values; 11 shared parameters, then 6 of the mount."""


def linearise(
    state: RegistrationState, station: int, measured_s: Floats, position_m: Floats, turn: Floats, truth: TruthSpline
) -> Linearised:
    """Linearise the model of one station at its records: device times (N,), positions (N, 3), quaternions (N, 4)."""
    count = len(measured_s)
    room, mount_m, mount = state.tracker_from_world, state.mount_m[station], state.body_from_station[station]
    rate = 1.0 / (1.0 + state.clock_ratio)
    residual, slope = np.zeros((count, 6)), np.zeros((count, 6, SHARED + OWN))

    time_s = state.truth_time_s(measured_s, of_position=True)
    (body_m, body), (velocity, omega) = truth.poses(time_s), truth.rates(time_s)
    factor = 1.0 + state.scale
    in_room = rotations.rotate(room, body_m + rotations.rotate(body, mount_m) - state.tracker_origin_m)
    speed = rotations.rotate(room, velocity + rotations.rotate(body, rotations.cross(omega, mount_m)))
    residual[:, :3] = position_m - factor * in_room
    slope[:, :3, ROOM_TURN] = -factor * _skew(in_room)
    slope[:, :3, ROOM_ORIGIN] = -factor * rotations.to_matrix(room)
    slope[:, :3, SCALE] = in_room
    slope[:, :3, OFFSET_POSITION] = -rate * factor * speed
    slope[:, :3, CLOCK] = -rate * factor * speed * (time_s - state.reference_s)[:, None]
    slope[:, :3, SHARED + 3 :] = factor * rotations.to_matrix(rotations.multiply(room, body))

    time_s = state.truth_time_s(measured_s, of_position=False)
    (_, body), (_, omega) = truth.poses(time_s), truth.rates(time_s)
    headed = rotations.multiply(rotations.about_z(state.heading_rad), room)
    in_tracker = rotations.multiply(headed, body)
    modelled = rotations.multiply(in_tracker, mount)
    rate_rad_s = rotations.rotate(in_tracker, omega)
    residual[:, 3:] = rotations.log(rotations.multiply(turn, rotations.inverse(modelled)))
    slope[:, 3:, ROOM_TURN] = rotations.to_matrix(rotations.about_z(state.heading_rad))
    slope[:, 5, HEADING] = 1.0
    slope[:, 3:, OFFSET_ORIENTATION] = -rate * rate_rad_s
    slope[:, 3:, CLOCK] = -rate * rate_rad_s * (time_s - state.reference_s)[:, None]
    slope[:, 3:, SHARED : SHARED + 3] = rotations.to_matrix(in_tracker)
    return Linearised(residual, slope)


def _skew(vectors: Floats) -> Floats:
    """Matrices (N, 3, 3) of the cross products with vectors (N, 3)."""
    out = np.zeros((len(vectors), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    result: Floats = out - out.swapaxes(1, 2)
    return result


def _unit(quaternion: Floats) -> Floats:
    out: Floats = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    return out
