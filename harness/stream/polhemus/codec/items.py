"""The items that a data record may contain, as a table (docs/is900.md 5.1).

A record is a row of a structured numpy type with one field per item, whether it was binary or ASCII. The type is the
binary layout itself; `records` converts text to the same rows.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from harness.errors import BadInput, UnknownName

RECORD_HEAD = ord("0")
"""Byte 0 of every data record."""
BLANK_STATUS = ord(" ")
"""Byte 2, the status, of records of an IS-900."""
HEADER_BYTES = 3
"""Number of bytes before the items: head, station, status."""
STATION_CHARACTERS = b"123456789ABC"
DeviceFamily = Literal["is900", "fastrak"]
DEVICE_NAMES: dict[DeviceFamily, str] = {"is900": "IS-900", "fastrak": "FASTRAK"}
FAMILY_STATIONS: dict[DeviceFamily, bytes] = {"is900": STATION_CHARACTERS, "fastrak": STATION_CHARACTERS[:4]}
"""Characters of the stations that a device of a family may have (docs/is900.md 5; docs/device.md, FASTRAK)."""
MOST_DEVICE_HZ: dict[DeviceFamily, float] = {"is900": 180.0, "fastrak": 120.0}
"""Highest rate of a station [Hz]."""
POSE_ERRORS: dict[DeviceFamily, bytes] = {"is900": b"", "fastrak": b"jklxy"}
"""Status letters of a record that concern its pose: the receiver's signal is saturated (j), low (k) or zero (l), or the
station is outside its box (x) or its angles (y) (docs/device.md, FASTRAK)."""
STANDARD_LIST = (40, 2, 11, 21, 1)
"""Quality, position, quaternion, time, CR LF: 38 bytes."""
SHORT_LIST = (40, 18, 19, 21, 1)
"""Quality, position and angles in the 16-bit format, time, CR LF: 22 bytes. Positions have a range of 3 m."""
FULL_SCALE_M, FULL_SCALE_DEG = 3.0, 180.0
"""Full scale of the 16-bit format (docs/is900.md 5.2) [m, deg]."""
SINCE_FIRMWARE = {40: 4.13, 76: 4.26}
"""Firmware version that introduced an item (docs/is900.md 5.1)."""
BITS_PER_BYTE = 10
"""Bits on the line per byte for 8N1: a start bit, eight bits, a stop bit (docs/is900.md 2)."""
BAUD_RATES = (115200, 57600, 38400, 19200, 9600)
"""Baud rates in the sequence in which InterSense's own library tries them (docs/is900.md 2) [bit/s]."""


def with_article(family: DeviceFamily) -> str:
    """Return the name of a device of this family within a sentence: `an IS-900`."""
    return f"{'an' if family == 'is900' else 'a'} {DEVICE_NAMES[family]}"


@dataclass(frozen=True)
class OutputItem:
    """One entry of an output list; it has `count` values."""

    name: str
    kind: str
    """numpy type of one binary value."""
    count: int
    width: int = 0
    """Characters of one right-aligned value in ASCII; 0 where ASCII records hold the binary bytes."""
    decimals: int = 0
    """Digits after the decimal point in ASCII."""
    exponent: bool = False
    """Whether a value in ASCII has an exponent and a blank at its end."""
    blanks: int = 0
    """Blanks after the values in ASCII."""
    fixed: bytes = b""
    """The bytes of an item whose bytes never change."""
    sevens: bool = False
    """Whether the bytes are the 7-bit pairs of docs/is900.md 5.2."""

    @property
    def ascii_size(self) -> int:
        """Length in an ASCII record [bytes]."""
        return self.count * (self.width or np.dtype(self.kind).itemsize) + self.blanks


ITEMS: dict[int, OutputItem] = {
    0: OutputItem("space", "u1", 1, fixed=b" "),
    1: OutputItem("end_of_line", "u1", 2, fixed=b"\r\n"),
    2: OutputItem("position", "<f4", 3, 7, 2),
    4: OutputItem("yaw_pitch_roll_deg", "<f4", 3, 7, 2),
    5: OutputItem("x_cosines", "<f4", 3, 7, 4),
    6: OutputItem("y_cosines", "<f4", 3, 7, 4),
    7: OutputItem("z_cosines", "<f4", 3, 7, 4),
    11: OutputItem("quaternion", "<f4", 4, 7, 4),
    16: OutputItem("stylus", "u1", 1, 1),
    18: OutputItem("position_16", "u1", 6, sevens=True),
    19: OutputItem("yaw_pitch_roll_16", "u1", 6, sevens=True),
    20: OutputItem("quaternion_16", "u1", 8, sevens=True),
    21: OutputItem("time", "<f4", 1, 14),
    22: OutputItem("buttons", "u1", 1, 4, blanks=1),
    23: OutputItem("joystick", "u1", 2, 4),
    38: OutputItem("camera_position", "<f4", 3, 7, 2),
    39: OutputItem("camera_yaw_pitch_roll_deg", "<f4", 3, 7, 2),
    40: OutputItem("quality", "u1", 1, 4),
    41: OutputItem("time_code", "<u4", 1, 10),
    42: OutputItem("user_bits", "<u4", 1, 10),
    43: OutputItem("encoder_1", "<i4", 1, 8),
    44: OutputItem("encoder_2", "<i4", 1, 8),
    45: OutputItem("encoder_3", "<i4", 1, 8),
    46: OutputItem("lens_1", "<f4", 1, 7, 2),
    47: OutputItem("lens_2", "<f4", 1, 7, 2),
    48: OutputItem("lens_3", "<f4", 1, 7, 2),
    49: OutputItem("lens_4", "<f4", 1, 7, 2),
    50: OutputItem("space", "u1", 1, fixed=b" "),
    51: OutputItem("end_of_line", "u1", 2, fixed=b"\r\n"),
    52: OutputItem("position", "<f4", 3, 13, 5, exponent=True),
    54: OutputItem("yaw_pitch_roll_deg", "<f4", 3, 13, 5, exponent=True),
    55: OutputItem("x_cosines", "<f4", 3, 13, 5, exponent=True),
    56: OutputItem("y_cosines", "<f4", 3, 13, 5, exponent=True),
    57: OutputItem("z_cosines", "<f4", 3, 13, 5, exponent=True),
    61: OutputItem("quaternion", "<f4", 4, 13, 5, exponent=True),
    66: OutputItem("stylus", "u1", 1, 1),
    75: OutputItem("radio_integrity", "u1", 1, 4),
    76: OutputItem("measurement_quality", "u1", 1, 4),
}
"""Items by code. Some facts are inferred, not documented: 41 to 45 are integers; 16 has one digit per byte in ASCII; 75
and 76, whose ranges are known, have the layout of 40."""
EXTENDED_ITEMS = frozenset((50, 51, 52, 54, 55, 56, 57, 61, 66))
"""Items of a FASTRAK that repeat others with an exponent and more digits in ASCII (its manual, revision G, page 59). In
binary they are taken to be the same numbers."""
UNDOCUMENTED_ITEMS = (68, 69, 70, 71)
"""The auxiliary inputs. Their sizes are on pages of the manual that are illegible."""


def missing_items(items: Iterable[int], firmware: float) -> list[int]:
    """The items that firmware of this version does not have yet."""
    return [code for code in items if firmware < SINCE_FIRMWARE.get(code, 0.0)]


@lru_cache(maxsize=64)
def resolve_items(items: tuple[int, ...], stylus_bytes: int = 1) -> tuple[OutputItem, ...]:
    """Return the items of a list. Repeated items are spaces and line ends; they get names of their own.

    Raises UnknownName for a code in no source, and BadInput for an item of unknown size or one listed twice.
    """
    out: list[OutputItem] = []
    for position, code in enumerate(items):
        if code in UNDOCUMENTED_ITEMS:
            raise BadInput(
                f"Output item {code} (auxiliary input): no source gives its size, so records cannot be decoded.",
                "Remove it from the list.",
            )
        if code not in ITEMS:
            raise UnknownName("output item", str(code), [str(known) for known in ITEMS])
        item = ITEMS[code] if code != 16 else replace(ITEMS[code], count=stylus_bytes)
        if any(item.name == other.name for other in out):
            if not item.fixed:
                raise BadInput(f"Output item {code} ({item.name}) is listed twice.", "List it once.")
            item = replace(item, name=f"{item.name}_{position}")
        out.append(item)
    return tuple(out)


@lru_cache(maxsize=64)
def record_type(items: tuple[int, ...], stylus_bytes: int = 1) -> np.dtype[Any]:
    """Return the packed layout of a binary record: `head`, `station`, `status`, then each item by its name."""
    fields = [
        (item.name, item.kind) if item.count == 1 else (item.name, item.kind, (item.count,))
        for item in resolve_items(items, stylus_bytes)
    ]
    return np.dtype([("head", "u1"), ("station", "u1"), ("status", "u1"), *fields])


@lru_cache(maxsize=64)
def record_size(items: tuple[int, ...], binary: bool = True, stylus_bytes: int = 1) -> int:
    """Return the length of a record on the wire [bytes]."""
    if binary:
        return int(record_type(items, stylus_bytes).itemsize)
    return HEADER_BYTES + sum(item.ascii_size for item in resolve_items(items, stylus_bytes))


def terminator(items: tuple[int, ...]) -> bytes:
    """Return the fixed bytes at the end of a record: CR LF, a space, or b"" when the last item is not fixed."""
    return ITEMS[items[-1]].fixed if items else b""


def position_range_m(items: tuple[int, ...]) -> float | None:
    """Return the largest coordinate that a list can carry [m]; None where nothing limits it but the tracker."""
    return FULL_SCALE_M if 18 in items and 2 not in items else None


def describe_list(items: tuple[int, ...]) -> str:
    """Return a list with its length, and with its range where it has one: `22 bytes, range 3 m`."""
    range_m = position_range_m(items)
    return f"{record_size(items)} bytes" + (f", range {range_m:g} m" if range_m else "")
