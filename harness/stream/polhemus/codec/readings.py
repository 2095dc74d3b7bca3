"""The content of records in SI units: one row per record, whatever the output list."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.stream.polhemus.codec.clock import MAX_STAMP_S
from harness.stream.polhemus.codec.items import FULL_SCALE_DEG, FULL_SCALE_M
from harness.stream.polhemus.codec.records import (
    RecordFormat,
    Table,
    from_yaw_pitch_roll_deg,
    unpack_14_bit,
)

MAX_DISTANCE_M = 20.0
"""An IS-900 tracks no farther from its origin; a larger distance is a damaged number [m]."""
LAST_CODE = 1.0 - 4.0 / 32768.0
"""Share of full scale of the last code of the 16-bit format; the first is -1."""


@dataclass(frozen=True, eq=False)
class Readings:
    """N records, in the order of the wire."""

    station: Ints
    """(N,) row of the station."""
    received_s: Floats
    """(N,) host clock when the last byte arrived [s]."""
    measured_s: Floats
    """(N,) device clock [s]; NaN where the record has no usable stamp."""
    position_m: Floats
    """(N, 3) in the tracker frame [m]; NaN when the list has none, and where an axis is at an end of the list's range:
    the station may be anywhere beyond."""
    tracker_from_station: Floats
    """(N, 4) as on the wire, nearly of unit length; NaN when the list has none."""
    quality: Floats
    """(N,) 0 (lost) to 1 (best), from item 40, else 76; 1 when the list has neither."""
    suspect: Bools
    """(N,) True where there is evidence against the record."""

    def __len__(self) -> int:
        return len(self.station)

    def __getitem__(self, rows: slice) -> "Readings":
        return Readings(*(column[rows] for column in self.columns()))

    def with_suspect(self, suspect: Bools) -> "Readings":
        """Return the same readings with this (N,) `suspect`."""
        leading = self.station, self.received_s, self.measured_s, self.position_m
        return Readings(*leading, self.tracker_from_station, self.quality, suspect)

    def columns(self) -> list[NDArray[Any]]:
        """Return the arrays, in the order of the fields."""
        return [getattr(self, name) for name in self.__dataclass_fields__]


def concatenate_readings(parts: list[Readings]) -> Readings:
    """Concatenate readings; at least one part is needed."""
    return (
        parts[0] if len(parts) == 1 else Readings(*map(np.concatenate, zip(*(p.columns() for p in parts), strict=True)))
    )


def decode_readings(table: Table, received_s: Floats, stations: bytes, settings: RecordFormat) -> Readings:
    """Decode a table (N,) of records received at times (N,) [s]; `stations` are the characters of the rows, in this
    order.

    Orientation is taken from the quaternion (items 11, 20), else the angles (4, 19), else two or three axes (5 to 7). A
    reading is suspect when no sound record can contain it. That is a number that is not finite, a position beyond
    `MAX_DISTANCE_M`, a quaternion or axes of another length than 1, angles out of range, or a negative stamp.
    """
    names = table.dtype.names or ()
    count = len(table)
    suspect = np.zeros(count, bool)
    position_m, quaternion, measured_s = _nan_array(count, 3), _nan_array(count, 4), _nan_array(count)
    with np.errstate(invalid="ignore", over="ignore"):
        if name := next((n for n in names if n in _POSITION_DECODERS), ""):
            position_m = _POSITION_DECODERS[name](table[name], settings)
            if name == "position":
                suspect |= ~(np.abs(position_m).max(axis=1, initial=0.0) < MAX_DISTANCE_M)
        if convert := next((c for kind, c in _ORIENTATION_DECODERS.items() if kind in names), None):
            quaternion, sound = convert(table, settings)
            suspect |= ~sound
        elif len(axes := [n for n in _AXES if n in names]) >= 2:
            quaternion, sound = _quaternions_from_axes(table, axes, settings)
            suspect |= ~sound
        if "time" in names:
            measured_s = table["time"].astype(float) * settings.seconds_per_tick
            invalid = ~((measured_s >= 0.0) & (measured_s < MAX_STAMP_S))
            measured_s[invalid] = np.nan
            suspect |= invalid
    station = _station_rows(stations)[table["station"]]
    return Readings(station, received_s, measured_s, position_m, quaternion, _quality(table, names, count), suspect)


def has_quality(items: tuple[int, ...]) -> bool:
    """Whether records of this list report how well their station is tracked."""
    return 40 in items or 76 in items


def _quality(table: Table, names: tuple[str, ...], count: int) -> Floats:
    if "quality" in names:
        return table["quality"] / 255.0
    if "measurement_quality" in names:
        return np.minimum(table["measurement_quality"] / 100.0, 1.0)
    return np.ones(count)


def _positions_in_range_m(share: Floats) -> Floats:
    """Convert shares of full scale (N, 3) to positions [m]; NaN where an axis has the first or the last code."""
    saturated = np.any((share <= -1.0) | (share >= LAST_CODE), axis=1)
    return np.where(saturated[:, None], np.nan, FULL_SCALE_M * share)


def _nan_array(*shape: int) -> Floats:
    return np.full(shape, np.nan)


@lru_cache(maxsize=16)
def _station_rows(stations: bytes) -> Ints:
    """Return the row (256,) of each station character, -1 where there is none."""
    row = np.full(256, -1, dtype=np.int64)
    row[np.frombuffer(stations, np.uint8)] = np.arange(len(stations))
    return row


def _check_quaternions(quaternion: Floats, tolerance: float) -> tuple[Floats, Bools]:
    """Return quaternions (N, 4) and whether their squared norms (N,) are 1 within the tolerance."""
    return quaternion, np.abs(np.einsum("ij,ij->i", quaternion, quaternion) - 1.0) < tolerance


def _quaternions_from_angles(angles: Floats) -> tuple[Floats, Bools]:
    """Convert yaw, pitch and roll (N, 3) [deg] to quaternions (N, 4), and check their ranges (N,).

    Rows out of range are NaN.
    """
    sound: Bools = np.all(np.abs(angles) < _ANGLES_DEG, axis=1)
    return from_yaw_pitch_roll_deg(np.where(sound[:, None], angles, np.nan)), sound


def _quaternions_from_axes(table: Table, axes: list[str], settings: RecordFormat) -> tuple[Floats, Bools]:
    """Convert two or three of the station's axes to quaternions (N, 4), and check that they are orthonormal (N,).

    Other rows are NaN.
    """
    columns = {name: table[name].astype(float) for name in axes}
    for k, name in enumerate(_AXES):
        if name not in columns:
            columns[name] = np.cross(columns[_AXES[k - 2]], columns[_AXES[k - 1]])
    matrix = np.stack([columns[name] for name in _AXES], axis=-1)
    off = np.abs(np.swapaxes(matrix, 1, 2) @ matrix - np.eye(3)).max(axis=(1, 2))
    sound = (off < _norm_tolerance(settings)) & (np.linalg.det(np.nan_to_num(matrix)) > 0.0)
    quaternion = rotations.from_matrix(np.where(sound[:, None, None], matrix, np.eye(3)))
    return np.where(sound[:, None], quaternion, np.nan), sound


def _norm_tolerance(settings: RecordFormat) -> float:
    """Tolerance of the squared norm: rounding to single precision, or to four decimals."""
    return 1e-4 if settings.binary else 1e-3


_AXES = ("x_cosines", "y_cosines", "z_cosines")
_ANGLES_DEG: Floats = np.array([180.01, 90.01, 180.01])
_POSITION_DECODERS: dict[str, Callable[[Any, RecordFormat], Floats]] = {
    "position": lambda field, settings: field.astype(float) * settings.metres_per_unit,
    "position_16": lambda field, settings: _positions_in_range_m(unpack_14_bit(field)),
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
"""Convert an item to quaternions (N, 4) and whether they are sound (N,)."""
