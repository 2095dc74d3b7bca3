"""Effect of alignment, boresight and tip offset on a reading (docs/is900.md 4.1).

The sources give the purpose of each, but neither their sequence nor the side of multiplication. Our interpretation is:
the tip in the station's axes, then the alignment, then boresight, which affects orientation alone.
"""

from dataclasses import replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec.records import from_yaw_pitch_roll_deg, yaw_pitch_roll_deg
from harness.stream.emulator.settings import Quaternion, StationSettings, Vector

_AXIS_POINT_M = 2.0
"""Distance from the origin of the points on the axes in the reply to an alignment query; any distance is equivalent
[m]."""


def apply_station_settings(position_m: Floats, quaternion: Floats, station: StationSettings) -> tuple[Floats, Floats]:
    """Convert the position (3,) and quaternion (4,) of a reading to what the station reports."""
    if station.plain:
        return position_m, quaternion
    position_m, quaternion = _apply_alignment(position_m, quaternion, station)
    return position_m, rotations.multiply(
        rotations.multiply(np.array(station.heading_boresight), quaternion), np.array(station.full_boresight)
    )


def align(station: StationSettings, origin_m: Floats, on_x_m: Floats, on_y_m: Floats) -> StationSettings | None:
    """Return settings whose frame has these points (3,) in the present frame [m]; None when they define no frame."""
    x, towards_y = on_x_m - origin_m, on_y_m - origin_m
    z = np.cross(x, towards_y)
    if not (np.linalg.norm(z) > 1e-6 * np.linalg.norm(x) * np.linalg.norm(towards_y) > 0.0):
        return None
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    present = np.array(station.tracker_from_aligned)
    aligned = rotations.multiply(present, rotations.from_matrix(np.stack([x, np.cross(z, x), z], axis=1)))
    origin = np.array(station.origin_m) + rotations.rotate(present, origin_m)
    return replace(station, origin_m=_vector(origin), tracker_from_aligned=_quaternion(aligned))


def alignment_cm(station: StationSettings) -> tuple[float, ...]:
    """Return the nine numbers of the present alignment in the tracker frame [cm].

    They are the origin, a point on the X axis and a point on the Y axis.
    """
    axes = rotations.to_matrix(np.array(station.tracker_from_aligned))
    origin = np.array(station.origin_m)
    points = np.concatenate([origin, origin + _AXIS_POINT_M * axes[:, 0], origin + _AXIS_POINT_M * axes[:, 1]])
    return tuple((100.0 * points).tolist())


def boresight(station: StationSettings, quaternion: Floats, full: bool) -> StationSettings:
    """Return settings with which this raw quaternion (4,) is reported as the reference angles (`G`).

    Without `full`, only its heading is.
    """
    _, present = _apply_alignment(np.zeros(3), quaternion, station)
    reference = from_yaw_pitch_roll_deg(np.array([station.reference_deg]))[0]
    if full:
        correction = rotations.multiply(rotations.inverse(present), reference)
        return replace(clear_boresight(station), full_boresight=_quaternion(correction))
    correction_deg = station.reference_deg[0] - float(yaw_pitch_roll_deg(present[None])[0, 0])
    return replace(
        clear_boresight(station), heading_boresight=_quaternion(rotations.about_z(np.deg2rad(correction_deg)))
    )


def clear_boresight(station: StationSettings) -> StationSettings:
    """Return settings without boresight."""
    return replace(station, heading_boresight=(1.0, 0.0, 0.0, 0.0), full_boresight=(1.0, 0.0, 0.0, 0.0))


def _apply_alignment(position_m: Floats, quaternion: Floats, station: StationSettings) -> tuple[Floats, Floats]:
    """Convert a reading to what the station reports, except for boresight."""
    position_m = position_m + rotations.rotate(quaternion, np.array(station.tip_m))
    aligned_from_tracker = rotations.inverse(np.array(station.tracker_from_aligned))
    position_m = rotations.rotate(aligned_from_tracker, position_m - np.array(station.origin_m))
    return position_m, rotations.multiply(aligned_from_tracker, quaternion)


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _quaternion(values: Floats) -> Quaternion:
    w, x, y, z = values.tolist()
    return w, x, y, z
