"""What records say, in SI units: one row per record, whatever the output list."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Bools, Floats, Ints
from harness.stream.clock import LATEST_S
from harness.stream.records import (
    FULL_SCALE_DEG,
    FULL_SCALE_M,
    Settings,
    Table,
    from_yaw_pitch_roll_deg,
    unpack_14_bit,
)

FARTHEST_M = 20.0
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
    """(N,) 0 lost to 1 best; 1 when the list does not tell."""
    doubtful: Bools
    """(N,) True where something speaks against the record."""

    def __len__(self) -> int:
        return len(self.station)

    def __getitem__(self, rows: slice) -> "Readings":
        return Readings(*(column[rows] for column in self.columns()))

    def columns(self) -> list[NDArray[Any]]:
        """The arrays, in the order of the fields."""
        return [getattr(self, field.name) for field in fields(self)]


def join(parts: list[Readings]) -> Readings:
    """Readings one after another; at least one part."""
    return (
        parts[0] if len(parts) == 1 else Readings(*map(np.concatenate, zip(*(p.columns() for p in parts), strict=True)))
    )


def readings(table: Table, received_s: Floats, stations: bytes, settings: Settings) -> Readings:
    """A table (N,) of records whose stations are among these characters, in this order, received at these times (N,).

    Doubtful is what no sound record says: a number that is not finite, a place beyond `FARTHEST_M`, a quaternion
    whose length is not 1, a stamp before zero.
    """
    row = np.full(256, -1, dtype=np.int64)
    row[np.frombuffer(stations, np.uint8)] = np.arange(len(stations))
    names = table.dtype.names or ()
    count = len(table)
    position_m, turn = np.full((count, 3), np.nan), np.full((count, 4), np.nan)
    measured_s, doubtful = np.full(count, np.nan), np.zeros(count, bool)
    with np.errstate(invalid="ignore", over="ignore"):
        if name := next((n for n in names if n in _POSITION), ""):
            position_m = _POSITION[name](table[name], settings)
            doubtful |= ~(np.abs(position_m).max(axis=1, initial=0.0) < FARTHEST_M)
        if name := next((n for n in names if n in _ORIENTATION), ""):
            convert, slack = _ORIENTATION[name]
            turn = convert(table[name])
            doubtful |= ~(np.abs(np.sum(turn * turn, axis=1) - 1.0) < slack)
        if "time" in names:
            measured_s = table["time"].astype(float) * settings.seconds_per_tick
            amiss = ~((measured_s >= 0.0) & (measured_s < LATEST_S))
            measured_s[amiss] = np.nan
            doubtful |= amiss
    quality = table["quality"] / 255.0 if "quality" in names else np.ones(count)
    return Readings(row[table["station"]], received_s, measured_s, position_m, turn, quality, doubtful)


_POSITION: dict[str, Callable[[Table, Settings], Floats]] = {
    "position": lambda field, settings: field.astype(float) * settings.metres_per_unit,
    "position_16": lambda field, settings: FULL_SCALE_M * unpack_14_bit(field),
}
_ORIENTATION: dict[str, tuple[Callable[[Table], Floats], float]] = {
    "quaternion": (lambda field: field.astype(float), 1e-4),
    "yaw_pitch_roll_deg": (lambda field: from_yaw_pitch_roll_deg(field.astype(float)), 1e-4),
    "quaternion_16": (unpack_14_bit, 1e-3),
    "yaw_pitch_roll_16": (lambda field: from_yaw_pitch_roll_deg(FULL_SCALE_DEG * unpack_14_bit(field)), 1e-4),
}
"""How each item becomes a quaternion, and how far the square of its length may be from 1."""
