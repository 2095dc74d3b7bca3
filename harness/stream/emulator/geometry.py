"""What alignment, boresight, tip offset and mounting angles make of a reading (docs/is900.md 4.1).

The sources say what each is for; the order and the sides that are multiplied from are our reading of them: the tip in
the station's axes, then the mounting, then the alignment, then boresight, which turns orientation alone.
"""

from dataclasses import replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec.records import from_yaw_pitch_roll_deg, yaw_pitch_roll_deg
from harness.stream.emulator.settings import Quaternion, StationSettings, Vector

_AXIS_POINT_M = 2.0
"""Points on the axes lie so far from the origin where an alignment is read; any distance says the same."""


def apply_station_settings(position_m: Floats, turn: Floats, station: StationSettings) -> tuple[Floats, Floats]:
    """Place (3,) and orientation (4,) of a reading as the station's settings let it be reported."""
    if station.plain:
        return position_m, turn
    position_m, turn = _apply_alignment(position_m, turn, station)
    return position_m, rotations.multiply(
        rotations.multiply(np.array(station.heading_boresight), turn), np.array(station.full_boresight)
    )


def align(station: StationSettings, origin_m: Floats, on_x_m: Floats, on_y_m: Floats) -> StationSettings | None:
    """The alignment whose frame has these points (3,) in the present one; None where they fix no frame."""
    x, towards_y = on_x_m - origin_m, on_y_m - origin_m
    z = np.cross(x, towards_y)
    if not (np.linalg.norm(z) > 1e-6 * np.linalg.norm(x) * np.linalg.norm(towards_y) > 0.0):
        return None
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    present = np.array(station.tracker_from_aligned)
    turned = rotations.multiply(present, rotations.from_matrix(np.stack([x, np.cross(z, x), z], axis=1)))
    origin = np.array(station.origin_m) + rotations.rotate(present, origin_m)
    return replace(station, origin_m=_vector(origin), tracker_from_aligned=_turn(turned))


def alignment_cm(station: StationSettings) -> tuple[float, ...]:
    """The nine numbers of the present alignment: origin, a point on X, a point on Y, in the tracker's frame [cm]."""
    axes = rotations.to_matrix(np.array(station.tracker_from_aligned))
    origin = np.array(station.origin_m)
    points = np.concatenate([origin, origin + _AXIS_POINT_M * axes[:, 0], origin + _AXIS_POINT_M * axes[:, 1]])
    return tuple((100.0 * points).tolist())


def boresight(station: StationSettings, turn: Floats, full: bool) -> StationSettings:
    """From now on this orientation (4,), as it was taken, reads as the reference; or its heading alone does."""
    _, now = _apply_alignment(np.zeros(3), turn, station)
    wanted = from_yaw_pitch_roll_deg(np.array([station.reference_deg]))[0]
    if full:
        after = rotations.multiply(rotations.inverse(now), wanted)
        return replace(clear_boresight(station), full_boresight=_turn(after))
    by_deg = station.reference_deg[0] - float(yaw_pitch_roll_deg(now[None])[0, 0])
    return replace(clear_boresight(station), heading_boresight=_turn(rotations.about_z(np.deg2rad(by_deg))))


def clear_boresight(station: StationSettings) -> StationSettings:
    return replace(station, heading_boresight=(1.0, 0.0, 0.0, 0.0), full_boresight=(1.0, 0.0, 0.0, 0.0))


def _apply_alignment(position_m: Floats, turn: Floats, station: StationSettings) -> tuple[Floats, Floats]:
    """The same before boresight."""
    position_m = position_m + rotations.rotate(turn, np.array(station.tip_m))
    mounting = from_yaw_pitch_roll_deg(np.array([station.mounting_deg]))[0]
    position_m, turn = rotations.rotate(mounting, position_m), rotations.multiply(mounting, turn)
    aligned_from_tracker = rotations.inverse(np.array(station.tracker_from_aligned))
    position_m = rotations.rotate(aligned_from_tracker, position_m - np.array(station.origin_m))
    return position_m, rotations.multiply(aligned_from_tracker, turn)


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _turn(values: Floats) -> Quaternion:
    w, x, y, z = values.tolist()
    return w, x, y, z
