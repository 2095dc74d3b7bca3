"""What a data record may hold: the items of an output list, as data (docs/is900.md 5.1).

Sizes and layouts are those of the binary form; a structured numpy type per list does the packing.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from harness.errors import UnknownName

HEAD = ord("0")
"""Byte 0 of every data record."""
BLANK = ord(" ")
"""Byte 2, the status, of an IS-900."""
STATION_CHARACTERS = b"123456789ABC"
STANDARD_LIST = (40, 2, 11, 21, 1)
"""Quality, position, quaternion, time, CR LF: 38 bytes."""


@dataclass(frozen=True)
class Item:
    """One entry of an output list."""

    name: str
    kind: str
    """numpy's name of one value."""
    count: int
    fixed: bytes = b""
    """The bytes themselves where they never change."""


ITEMS: dict[int, Item] = {
    0: Item("space", "u1", 1, b" "),
    1: Item("end_of_line", "u1", 2, b"\r\n"),
    2: Item("position", "<f4", 3),
    4: Item("yaw_pitch_roll_deg", "<f4", 3),
    5: Item("x_cosines", "<f4", 3),
    6: Item("y_cosines", "<f4", 3),
    7: Item("z_cosines", "<f4", 3),
    11: Item("quaternion", "<f4", 4),
    16: Item("stylus", "u1", 2),
    18: Item("position_16", "u1", 6),
    19: Item("yaw_pitch_roll_16", "u1", 6),
    20: Item("quaternion_16", "u1", 8),
    21: Item("time", "<f4", 1),
    22: Item("buttons", "u1", 1),
    23: Item("joystick", "u1", 2),
    38: Item("camera_position", "<f4", 3),
    39: Item("camera_yaw_pitch_roll_deg", "<f4", 3),
    40: Item("quality", "u1", 1),
    41: Item("time_code", "u1", 4),
    42: Item("user_bits", "u1", 4),
    43: Item("encoder_1", "u1", 4),
    44: Item("encoder_2", "u1", 4),
    45: Item("encoder_3", "u1", 4),
    46: Item("lens_1", "<f4", 1),
    47: Item("lens_2", "<f4", 1),
    48: Item("lens_3", "<f4", 1),
    49: Item("lens_4", "<f4", 1),
}
"""By code. Item 16 has two sizes in the sources; 2 bytes is what section 14 settles on."""


@lru_cache(maxsize=64)
def record_type(items: tuple[int, ...]) -> np.dtype[Any]:
    """The packed layout of a record: `head`, `station`, `status`, then each item by its name.

    UnknownName for a code that no source gives a size for; an item may be listed once.
    """
    fields: list[Any] = [("head", "u1"), ("station", "u1"), ("status", "u1")]
    for code in items:
        if code not in ITEMS:
            raise UnknownName("output item", str(code), [str(known) for known in ITEMS])
        item = ITEMS[code]
        fields.append((item.name, item.kind) if item.count == 1 else (item.name, item.kind, (item.count,)))
    return np.dtype(fields)


def size(items: tuple[int, ...]) -> int:
    """Bytes of a binary record."""
    return int(record_type(items).itemsize)


def terminator(items: tuple[int, ...]) -> bytes:
    """The fixed bytes that end a record: CR LF, a space, or nothing to go by."""
    return ITEMS[items[-1]].fixed if items else b""
