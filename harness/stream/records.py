"""IS-900 data records, binary: what a station's output list makes of a reading, and back (docs/is900.md section 5).

No I/O. A record is '0', the station's character, a space, then the list's items; its end is known from the list
alone. Lists are data: a numpy structured type per list turns thousands of records into bytes at once.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from harness.errors import BadInput

STATIONS = b"123456789ABC"
"""Station characters in the order in which the device reads them."""
LIST = (40, 2, 11, 21, 1)
"""Output list of this harness: quality, position, quaternion, timestamp, CR LF."""

_ITEMS: dict[int, tuple[str, str | tuple[str, tuple[int]]]] = {
    0: ("space", "S1"),
    1: ("end", "S2"),
    2: ("position", ("<f4", (3,))),
    4: ("angles_deg", ("<f4", (3,))),
    11: ("quaternion", ("<f4", (4,))),
    21: ("time", "<f4"),
    22: ("buttons", "u1"),
    23: ("joystick", ("u1", (2,))),
    40: ("quality", "u1"),
}
_CONSTANT = {"space": b" ", "end": b"\r\n"}


def record_type(items: Sequence[int] = LIST) -> np.dtype:
    """The layout of one record; fields head, station, status and one for each item. BadInput for unknown items."""
    unknown = [item for item in items if item not in _ITEMS]
    if unknown or len(set(items)) < len(items):
        raise BadInput(f"output list {list(items)}.", f"Each of {', '.join(map(str, _ITEMS))} may be in it once.")
    return np.dtype([("head", "S1"), ("station", "S1"), ("status", "S1"), *[_field(item) for item in items]])


def blank_records(count: int, items: Sequence[int] = LIST) -> NDArray[np.void]:
    """`count` records with everything constant filled in; `.tobytes()` is what goes on the wire."""
    records = np.zeros(count, record_type(items))
    records["head"], records["status"] = b"0", b" "
    for name, constant in _CONSTANT.items():
        if name in (records.dtype.names or ()):
            records[name] = constant
    return records


def looks_right(records: NDArray[np.void]) -> NDArray[np.bool_]:
    """(N,) whether head, station, status and terminators are those of a record."""
    known = np.frombuffer(STATIONS, "S1")
    right: NDArray[np.bool_] = (records["head"] == b"0") & (records["status"] == b" ")
    right &= np.isin(records["station"], known)
    for name, constant in _CONSTANT.items():
        if name in (records.dtype.names or ()):
            right &= records[name] == constant
    return right


def _field(item: int) -> tuple[str, str] | tuple[str, str, tuple[int]]:
    name, kind = _ITEMS[item]
    return (name, kind) if isinstance(kind, str) else (name, *kind)
