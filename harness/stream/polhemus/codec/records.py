"""Records of an output list as tables: SI units to items, and items to binary or ASCII bytes and back
(docs/is900.md 5).

Numbers of ASCII records are right-aligned in columns and may touch (`-12.50-100.00`), so they are cut by column, never
at blanks. Items of the 16-bit format have the same bytes as in binary.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.errors import BadInput
from harness.stream.polhemus.codec.items import (
    BLANK_STATUS,
    FULL_SCALE_DEG,
    FULL_SCALE_M,
    HEADER_BYTES,
    RECORD_HEAD,
    OutputItem,
    record_type,
    resolve_items,
)

_BYTE_PATTERN = rb"(?:   \d|  \d\d| [01]\d\d| 2[0-4]\d| 25[0-5])"
"""An integer from 0 to 255 in four columns."""


def format_records(items: tuple[int, ...], table: NDArray[Any], stylus_bytes: int = 1) -> bytes:
    """Format records (N,) as text.

    A number too wide for its column becomes the widest number; NaN becomes `nan`, as in C.
    """
    names = ["station", "status", *(item.name for item in resolve_items(items, stylus_bytes))]
    template = _format_string(items, stylus_bytes)
    columns: list[list[Any]] = [[[value] for value in table[name].tolist()] for name in names[:2]]
    for item in resolve_items(items, stylus_bytes):
        column = np.asarray(table[item.name]).reshape(len(table), -1)
        if item.width:
            highest, lowest = _value_range(item)
            columns.append(np.clip(column.astype(float), lowest, highest).tolist())
        else:
            columns.append([[row.tobytes()] for row in column])
    return b"".join(template % tuple(value for part in row for value in part) for row in zip(*columns, strict=True))


def parse_records(items: tuple[int, ...], raw: NDArray[np.uint8], stylus_bytes: int = 1) -> NDArray[Any]:
    """Parse the bytes (N, size) of N records, which match `item_pattern`, into a table (N,)."""
    table = np.empty(len(raw), record_type(items, stylus_bytes))
    table["head"], table["station"], table["status"] = raw[:, 0], raw[:, 1], raw[:, 2]
    offset = HEADER_BYTES
    for item in resolve_items(items, stylus_bytes):
        block: NDArray[Any] = raw[:, offset : offset + item.ascii_size]
        if item.width:
            block = np.ascontiguousarray(block[:, : item.count * item.width]).view(f"S{item.width}").astype(float)
        offset += item.ascii_size
        table[item.name] = block.reshape(table[item.name].shape)
    return table


@lru_cache(maxsize=64)
def item_pattern(item: OutputItem) -> bytes:
    """Return a regular expression that matches exactly what a device may write for this item."""
    if item.kind == "u1" and item.width == 4:
        return _BYTE_PATTERN * item.count + b" " * item.blanks
    if item.exponent:
        return (rb"[ -]\d\.\d{%d}E[+-]\d\d " % item.decimals) * item.count
    integer_digits = item.width - (item.decimals + 1 if item.decimals else 0)
    alternatives = [b" " * (integer_digits - k) + rb"\d{%d}" % k for k in range(integer_digits, 0, -1)]
    alternatives += [b" " * (integer_digits - k - 1) + rb"-\d{%d}" % k for k in range(integer_digits - 1, 0, -1)]
    value = b"(?:" + b"|".join(alternatives) + b")" + (rb"\.\d{%d}" % item.decimals if item.decimals else b"")
    return value * item.count + b" " * item.blanks


def _value_range(item: OutputItem) -> tuple[float, float]:
    """Return the largest and the smallest number that fit the columns of an item."""
    if item.exponent:
        return np.inf, -np.inf
    step, integer_digits = 10.0**-item.decimals, item.width - (item.decimals + 1 if item.decimals else 0)
    return 10.0**integer_digits - step, -(10.0 ** (integer_digits - 1)) + step


@lru_cache(maxsize=64)
def _format_string(items: tuple[int, ...], stylus_bytes: int) -> bytes:
    """Return the `%` format of a record."""
    return b"0%c%c" + b"".join(map(_item_format, resolve_items(items, stylus_bytes)))


def _item_format(item: OutputItem) -> bytes:
    if item.exponent:
        return b"%% .%dE " % item.decimals * item.count
    return b"%%%d.%df" % (item.width, item.decimals) * item.count + b" " * item.blanks if item.width else b"%b"


Table = NDArray[Any]
"""Records (N,) of one output list, with a field for each item (`items.record_type`)."""


@dataclass(frozen=True)
class RecordFormat:
    """How the device is configured to write numbers."""

    metres_per_unit: float = 0.01
    """Length of a unit [m]: 0.01 after `u` (centimetres), 0.0254 after `U` or power-on (inches)."""
    seconds_per_tick: float = 1e-3
    """Length of a clock tick [s]: 1e-3 after `MT` or power-on, 1e-6 after `Mt`."""
    binary: bool = True
    """True after `f`; False (ASCII) after `F` or power-on."""
    stylus_bytes: int = 1
    """Length of item 16: 1 in both manuals, 2 in two programs (docs/is900.md 14)."""

    def __post_init__(self) -> None:
        if not (self.metres_per_unit > 0.0 and self.seconds_per_tick > 0.0 and self.stylus_bytes in (1, 2)):
            raise BadInput(f"Not a record format: {self}.", "Units are positive; item 16 has 1 or 2 bytes.")


@dataclass(frozen=True, eq=False)
class RecordValues:
    """The values that N records report."""

    measured_s: Floats
    """(N,) device clock [s]."""
    position_m: Floats
    """(N, 3) position in the tracker frame [m]."""
    tracker_from_station: Floats
    """(N, 4) unit quaternions."""
    quality: Floats
    """(N,) 0 (lost) to 1 (best)."""
    buttons: Ints | int = 0
    """(N,) button bits, 0 where all are up (item 22)."""
    joystick: Ints | int = 127
    """(N, 2) left to right and rear to front, 0 to 255, centre 127 (item 23)."""

    def rows(self, rows: list[int]) -> "RecordValues":
        """Return the values of these records."""
        return RecordValues(
            self.measured_s[rows],
            self.position_m[rows],
            self.tracker_from_station[rows],
            self.quality[rows],
            self.buttons if isinstance(self.buttons, int) else self.buttons[rows],
            self.joystick if isinstance(self.joystick, int) else self.joystick[rows],
        )


def encode_records(
    items: tuple[int, ...], stations: NDArray[np.uint8], values: RecordValues, settings: RecordFormat
) -> Table:
    """Build the table (N,) of records of these station characters (N,); `to_bytes` converts it to bytes.

    Items of cameras, lenses and the stylus are 0, except that the frame of a camera set is the tracker's. The radio
    never loses a packet. Raises UnknownName or BadInput for an item of unknown size.
    """
    table = np.zeros(len(stations), record_type(items, settings.stylus_bytes))
    table["head"], table["station"], table["status"] = RECORD_HEAD, stations, BLANK_STATUS
    for item in resolve_items(items, settings.stylus_bytes):
        if item.fixed:
            table[item.name] = np.frombuffer(item.fixed, np.uint8) if item.count > 1 else item.fixed[0]
        elif item.name in _ITEM_ENCODERS:
            table[item.name] = _ITEM_ENCODERS[item.name](values, settings)
    return table


def to_bytes(items: tuple[int, ...], table: Table, settings: RecordFormat) -> bytes:
    """Return records (N,) as they go over the wire, binary or ASCII."""
    return table.tobytes() if settings.binary else format_records(items, table, settings.stylus_bytes)


def pack_14_bit(values: Floats) -> NDArray[np.uint8]:
    """Pack values (N, k), -1 to 1 of full scale, into the two-byte form (N, 2k) (docs/is900.md 5.2).

    Values beyond full scale become its first or last code.
    """
    sixteen = np.clip(np.trunc(np.asarray(values) * 32768.0), -32768, 32767).astype(np.int64)
    fourteen = (sixteen >> 2) & 0x3FFF
    pairs = (
        np.stack([fourteen & 0x7F, fourteen >> 7], axis=-1)
        .astype(np.uint8)
        .reshape(len(fourteen), 2 * fourteen.shape[1])
    )
    pairs[:, 0] |= 0x80
    return pairs


def unpack_14_bit(pairs: NDArray[np.uint8]) -> Floats:
    """Unpack the two-byte form (N, 2k) to values (N, k), -1 to 1 of full scale."""
    low, high = pairs[:, ::2].astype(np.uint16) & 0x7F, pairs[:, 1::2].astype(np.uint16) & 0x7F
    out: Floats = ((low << 2) | (high << 9)).view(np.int16) / 32768.0
    return out


def yaw_pitch_roll_deg(quaternions: Floats) -> Floats:
    """Convert quaternions (N, 4) to angles (N, 3) about Z, the new Y and the new X [deg] (docs/is900.md 5.3)."""
    rotation = rotations.to_matrix(quaternions)
    pitch = np.arcsin(np.clip(-rotation[:, 2, 0], -1.0, 1.0))
    out: Floats = np.rad2deg(
        np.stack(
            [np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]), pitch, np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])],
            axis=1,
        )
    )
    return out


def from_yaw_pitch_roll_deg(angles: Floats) -> Floats:
    """Convert yaw about Z, then pitch about the new Y, then roll about the new X (N, 3) [deg] to quaternions (N, 4)."""
    half = np.deg2rad(angles)[:, :, None]
    x, y, z = np.eye(3)
    yaw, pitch, roll = (rotations.exp(half[:, i] * axis) for i, axis in enumerate((z, y, x)))
    return rotations.multiply(rotations.multiply(yaw, pitch), roll)


def direction_cosines(quaternions: Floats, axis: int) -> Floats:
    """Return the station's X, Y or Z axis (N, 3) in the tracker frame, from quaternions (N, 4) (items 5, 6, 7)."""
    out: Floats = rotations.to_matrix(quaternions)[:, :, axis]
    return out


_ITEM_ENCODERS: dict[str, Callable[[RecordValues, RecordFormat], Any]] = {
    "position": lambda values, settings: values.position_m / settings.metres_per_unit,
    "yaw_pitch_roll_deg": lambda values, settings: yaw_pitch_roll_deg(values.tracker_from_station),
    "x_cosines": lambda values, settings: direction_cosines(values.tracker_from_station, 0),
    "y_cosines": lambda values, settings: direction_cosines(values.tracker_from_station, 1),
    "z_cosines": lambda values, settings: direction_cosines(values.tracker_from_station, 2),
    "quaternion": lambda values, settings: values.tracker_from_station,
    "position_16": lambda values, settings: pack_14_bit(values.position_m / FULL_SCALE_M),
    "yaw_pitch_roll_16": lambda values, settings: pack_14_bit(
        yaw_pitch_roll_deg(values.tracker_from_station) / FULL_SCALE_DEG
    ),
    "quaternion_16": lambda values, settings: pack_14_bit(values.tracker_from_station),
    "time": lambda values, settings: values.measured_s / settings.seconds_per_tick,
    "buttons": lambda values, settings: values.buttons,
    "joystick": lambda values, settings: values.joystick,
    "camera_position": lambda values, settings: values.position_m / settings.metres_per_unit,
    "camera_yaw_pitch_roll_deg": lambda values, settings: yaw_pitch_roll_deg(values.tracker_from_station),
    "quality": lambda values, settings: np.round(255.0 * np.clip(values.quality, 0.0, 1.0)),
    "radio_integrity": lambda values, settings: 100,
    "measurement_quality": lambda values, settings: np.round(100.0 * np.clip(values.quality, 0.0, 1.0)),
}
"""Encoder of each item, in wire units; other items are 0."""
