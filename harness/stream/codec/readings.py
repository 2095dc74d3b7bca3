"""What records say, in SI units: one row per record, whatever the output list."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.stream.codec.clock import MAX_STAMP_S
from harness.stream.codec.records import (
    FULL_SCALE_DEG,
    FULL_SCALE_M,
    RecordFormat,
    Table,
    from_yaw_pitch_roll_deg,
    unpack_14_bit,
)

MAX_DISTANCE_M = 20.0
"""No IS-900 tracks farther from its origin; a place beyond is a damaged number."""


@dataclass(frozen=True, eq=False)
class Readings:
    """N records in the order of the wire."""

    station: Ints
    """(N,) row of the station."""
    received_s: Floats
    """(N,) host clock when the last byte was there [s]."""
    measured_s: Floats
    """(N,) device clock [s]; NaN where the record has no usable stamp."""
    position_m: Floats
    """(N, 3) in the tracker frame [m]; NaN when the list has none."""
    tracker_from_station: Floats
    """(N, 4) as on the wire, nearly of unit length; NaN when the list has none."""
    quality: Floats
    """(N,) 0 lost to 1 best, from item 40, else 76; 1 when the list has neither."""
    suspect: Bools
    """(N,) True where something speaks against the record."""

    def __len__(self) -> int:
        return len(self.station)

    def __getitem__(self, rows: slice) -> "Readings":
        return Readings(*(column[rows] for column in self.columns()))

    def with_suspect(self, doubtful: Bools) -> "Readings":
        """The same readings, of which these (N,) are doubtful."""
        first = self.station, self.received_s, self.measured_s, self.position_m
        return Readings(*first, self.tracker_from_station, self.quality, doubtful)

    def columns(self) -> list[NDArray[Any]]:
        """The arrays, in the order of the fields."""
        return [getattr(self, name) for name in self.__dataclass_fields__]


def concatenate_readings(parts: list[Readings]) -> Readings:
    """Readings one after another; at least one part."""
    return (
        parts[0] if len(parts) == 1 else Readings(*map(np.concatenate, zip(*(p.columns() for p in parts), strict=True)))
    )


def decode_readings(table: Table, received_s: Floats, stations: bytes, settings: RecordFormat) -> Readings:
    """A table (N,) of records whose stations are among these characters, in this order, received at these times (N,).

    Orientation is the quaternion's (items 11, 20), else the angles' (4, 19), else that of two or three axes (5 to 7).
    Doubtful is what no sound record says: a number that is not finite, a place beyond `MAX_DISTANCE_M`, a quaternion or
    axes whose length is not 1, angles out of their range, a stamp before zero.
    """
    names = table.dtype.names or ()
    count = len(table)
    doubtful = np.zeros(count, bool)
    position_m, turn, measured_s = _nan_array(count, 3), _nan_array(count, 4), _nan_array(count)
    with np.errstate(invalid="ignore", over="ignore"):
        if name := next((n for n in names if n in _POSITION_DECODERS), ""):
            position_m = _POSITION_DECODERS[name](table[name], settings)
            doubtful |= ~(np.abs(position_m).max(axis=1, initial=0.0) < MAX_DISTANCE_M)
        if convert := next((c for kind, c in _ORIENTATION_DECODERS.items() if kind in names), None):
            turn, sound = convert(table, settings)
            doubtful |= ~sound
        elif len(axes := [n for n in _AXES if n in names]) >= 2:
            turn, sound = _quaternions_from_axes(table, axes, settings)
            doubtful |= ~sound
        if "time" in names:
            measured_s = table["time"].astype(float) * settings.seconds_per_tick
            amiss = ~((measured_s >= 0.0) & (measured_s < MAX_STAMP_S))
            measured_s[amiss] = np.nan
            doubtful |= amiss
    station = _station_rows(stations)[table["station"]]
    return Readings(station, received_s, measured_s, position_m, turn, _quality(table, names, count), doubtful)


def has_quality(items: tuple[int, ...]) -> bool:
    """Whether records of this list say how well their station is tracked."""
    return 40 in items or 76 in items


def _quality(table: Table, names: tuple[str, ...], count: int) -> Floats:
    if "quality" in names:
        return table["quality"] / 255.0
    if "measurement_quality" in names:
        return np.minimum(table["measurement_quality"] / 100.0, 1.0)
    return np.ones(count)


def _nan_array(*shape: int) -> Floats:
    return np.full(shape, np.nan)


@lru_cache(maxsize=16)
def _station_rows(stations: bytes) -> Ints:
    """(256,) the row of each station character, -1 where there is none."""
    row = np.full(256, -1, dtype=np.int64)
    row[np.frombuffer(stations, np.uint8)] = np.arange(len(stations))
    return row


def _check_quaternions(turn: Floats, slack: float) -> tuple[Floats, Bools]:
    """Quaternions (N, 4) and whether the squares of their lengths (N,) are 1, but for so much."""
    return turn, np.abs(np.einsum("ij,ij->i", turn, turn) - 1.0) < slack


def _quaternions_from_angles(angles: Floats) -> tuple[Floats, Bools]:
    """Quaternions (N, 4) of yaw, pitch and roll (N, 3) [deg], and whether these are within their ranges (N,);
    NaN where not."""
    sound: Bools = np.all(np.abs(angles) < _ANGLES_DEG, axis=1)
    return from_yaw_pitch_roll_deg(np.where(sound[:, None], angles, np.nan)), sound


def _quaternions_from_axes(table: Table, axes: list[str], settings: RecordFormat) -> tuple[Floats, Bools]:
    """Quaternions (N, 4) of two or three of the station's axes, and whether these are an orthonormal set (N,);
    NaN where not."""
    columns = {name: table[name].astype(float) for name in axes}
    for k, name in enumerate(_AXES):
        if name not in columns:
            columns[name] = np.cross(columns[_AXES[k - 2]], columns[_AXES[k - 1]])
    matrix = np.stack([columns[name] for name in _AXES], axis=-1)
    off = np.abs(np.swapaxes(matrix, 1, 2) @ matrix - np.eye(3)).max(axis=(1, 2))
    sound = (off < _norm_tolerance(settings)) & (np.linalg.det(np.nan_to_num(matrix)) > 0.0)
    turn = rotations.from_matrix(np.where(sound[:, None, None], matrix, np.eye(3)))
    return np.where(sound[:, None], turn, np.nan), sound


def _norm_tolerance(settings: RecordFormat) -> float:
    """How far the square of a length may be from 1: by rounding to single precision, or to four decimals."""
    return 1e-4 if settings.binary else 1e-3


_AXES = ("x_cosines", "y_cosines", "z_cosines")
_ANGLES_DEG: Floats = np.array([180.01, 90.01, 180.01])
_POSITION_DECODERS: dict[str, Callable[[Any, RecordFormat], Floats]] = {
    "position": lambda field, settings: field.astype(float) * settings.metres_per_unit,
    "position_16": lambda field, settings: FULL_SCALE_M * unpack_14_bit(field),
}
_ORIENTATION_DECODERS: dict[str, Callable[[Table, RecordFormat], tuple[Floats, Bools]]] = {
    "quaternion": lambda table, settings: _check_quaternions(
        table["quaternion"].astype(float), _norm_tolerance(settings)
    ),
    "quaternion_16": lambda table, settings: _check_quaternions(unpack_14_bit(table["quaternion_16"]), 1e-3),
    "yaw_pitch_roll_deg": lambda table, settings: _quaternions_from_angles(table["yaw_pitch_roll_deg"].astype(float)),
    "yaw_pitch_roll_16": lambda table, settings: _quaternions_from_angles(
        FULL_SCALE_DEG * unpack_14_bit(table["yaw_pitch_roll_16"])
    ),
}
"""What the item becomes: quaternions (N, 4) and whether they are sound (N,)."""
