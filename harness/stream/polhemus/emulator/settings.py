"""All settings of the device as one immutable value, and the effect of a station's geometry on its readings.

The sources give the purpose of alignment, boresight and tip offset (docs/is900.md 4.1), but neither their sequence nor
the side of multiplication. Our interpretation is: the tip in the station's axes, then the alignment, then boresight,
which affects orientation alone.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.polhemus.codec.records import from_yaw_pitch_roll_deg, yaw_pitch_roll_deg
from harness.stream.polhemus.codec.replies import Emitter

_INCH_M, _CENTIMETRE_M = 0.0254, 0.01
STATION_NAMES = "123456789ABC"
DEFAULT_OUTPUT_LIST = (2, 4, 1)
"""Position, angles, CR LF (docs/is900.md 12)."""
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
ZERO_VECTOR: Vector = (0.0, 0.0, 0.0)
IDENTITY_QUATERNION: Quaternion = (1.0, 0.0, 0.0, 0.0)
DEFAULT_EMITTERS = tuple(
    Emitter(
        1 + 3 * row + column, (0.9144 * row - 0.9144, 0.6096 * column - 0.6096, 0.0), (0.0, 0.0, 1.0), 5001 + number
    )
    for number, (row, column) in enumerate((row, column) for row in range(3) for column in range(3))
)
"""Three bars of three emitters that face down. They are made up, except for the spacings and the form of the first
number."""


@dataclass(frozen=True)
class StationSettings:
    """Settings of one station."""

    active: bool = False
    items: tuple[int, ...] = DEFAULT_OUTPUT_LIST
    origin_m: Vector = ZERO_VECTOR
    """Origin of the alignment frame in the tracker frame [m]."""
    tracker_from_aligned: Quaternion = IDENTITY_QUATERNION
    heading_boresight: Quaternion = IDENTITY_QUATERNION
    """Boresight of the heading: rotates reported orientations about the frame's own axes."""
    full_boresight: Quaternion = IDENTITY_QUATERNION
    """Full boresight: rotates the station's axes."""
    reference_deg: Vector = ZERO_VECTOR
    """Yaw, pitch and roll that the next boresight gives the present orientation (`G`) [deg]."""
    hemisphere: Vector = (1.0, 0.0, 0.0)
    """Direction of the half space in which a FASTRAK takes the station to be (`H`); zero where it follows the station.
    An IS-900 stores it without effect."""
    increment_m: float = 0.0
    """Movement along an axis after which a FASTRAK that streams sends the next record (`I`) [m]; 0 sends all."""
    tip_m: Vector = ZERO_VECTOR
    """Tip offset in the station's own axes [m]."""
    envelope_m: tuple[float, ...] = (10.0, 10.0, 10.0, -10.0, -10.0, -10.0)
    prediction_ms: int = 0
    enhancement: int = 0
    sensitivity: int = 3
    compass: int = 0

    @property
    def plain(self) -> bool:
        """Whether readings are reported as they were taken."""
        return (
            self.origin_m == self.tip_m == ZERO_VECTOR
            and self.tracker_from_aligned == self.heading_boresight == self.full_boresight == IDENTITY_QUATERNION
        )


@dataclass(frozen=True)
class DeviceSettings:
    """Settings of the device; the defaults are those after power-on (docs/is900.md 12)."""

    stations: tuple[StationSettings, ...] = field(default_factory=lambda: (StationSettings(),) * len(STATION_NAMES))
    binary: bool = False
    centimetres: bool = False
    microseconds: bool = False
    boresight_as_fastrak: bool = False
    lights: bool = True
    brightness: int = 100
    timeout_ms: int = 20
    """Ultrasonic time-out [ms]; the default is a choice."""
    gain: int = 1
    """Ultrasonic sensitivity; the default is a choice."""
    genlock: str = "0"
    genlock_hz: float = 0.0
    genlock_source: int = 1
    genlock_phase: float = 0.0
    emitters: tuple[Emitter, ...] = DEFAULT_EMITTERS
    draft_emitters: tuple[Emitter, ...] = DEFAULT_EMITTERS
    """Emitters that `MCe` would activate."""
    error_log: bool = True
    command_log: bool = False
    scheduling: int = 1
    lock: int = 0
    address: str = "192.168.1.10"
    udp: bool = False
    udp_port: int = 5001
    baud: int = 115200
    framing: tuple[str, int, int] = ("N", 8, 0)
    """Parity, bits and hardware handshake; stored without effect."""
    unit_in_commands: bool = False
    """Whether lengths in commands have the unit of records, as on a FASTRAK; an IS-900 takes centimetres."""

    @property
    def record_unit_m(self) -> float:
        """Unit of positions in records [m]."""
        return _CENTIMETRE_M if self.centimetres else _INCH_M

    @property
    def command_unit_m(self) -> float:
        """Unit of lengths in commands and their replies [m]."""
        return self.record_unit_m if self.unit_in_commands else _CENTIMETRE_M

    def station(self, name: str) -> StationSettings:
        """Return the settings of the station with this character."""
        return self.stations[STATION_NAMES.index(name)]

    def with_station(self, name: str, station: StationSettings) -> "DeviceSettings":
        """Return a copy in which this station has other settings."""
        k = STATION_NAMES.index(name)
        return replace(self, stations=(*self.stations[:k], station, *self.stations[k + 1 :]))


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


def into_hemisphere(position_m: Floats, station: StationSettings) -> Floats:
    """Return the position (3,) that a FASTRAK reports [m]: its field is the same at the opposite place.

    The manual says that the signs of x, y and z flip outside the hemisphere (revision G, pages 50 and 51). Orientation
    follows from the field, so it stays.
    """
    return -position_m if position_m @ np.array(station.hemisphere) < 0.0 else position_m


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


def alignment_m(station: StationSettings) -> tuple[float, ...]:
    """Return the nine numbers of the present alignment in the tracker frame [m].

    They are the origin, a point on the X axis and a point on the Y axis.
    """
    axes = rotations.to_matrix(np.array(station.tracker_from_aligned))
    origin = np.array(station.origin_m)
    points = np.concatenate([origin, origin + _AXIS_POINT_M * axes[:, 0], origin + _AXIS_POINT_M * axes[:, 1]])
    return tuple(points.tolist())


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
