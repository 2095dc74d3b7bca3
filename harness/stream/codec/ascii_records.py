"""Records as text: rows of a list's binary type into lines of fixed columns, and columns into rows (docs/is900.md 5.1).

Numbers stand right-aligned in columns and may touch (`-12.50-100.00`): they are cut by column, never by blanks.
Items of the 16-bit format are the same bytes as in binary.
"""

from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats
from harness.stream.codec.items import HEADER_BYTES, OutputItem, record_type, resolve_items

_BYTE_PATTERN = rb"(?:   \d|  \d\d| [01]\d\d| 2[0-4]\d| 25[0-5])"
"""0 to 255 in four columns."""


def format_records(items: tuple[int, ...], table: NDArray[Any], stylus_bytes: int = 2) -> bytes:
    """The text of records (N,). What is too wide for its column says the widest number; nan is `nan`, as in C."""
    names = ["station", "status", *(item.name for item in resolve_items(items, stylus_bytes))]
    form = _format_string(items, stylus_bytes)
    columns: list[list[Any]] = [[[value] for value in table[name].tolist()] for name in names[:2]]
    for item in resolve_items(items, stylus_bytes):
        column = np.asarray(table[item.name]).reshape(len(table), -1)
        if item.width:
            top, bottom = _value_range(item)
            columns.append(np.clip(column.astype(float), bottom, top).tolist())
        else:
            columns.append([[row.tobytes()] for row in column])
    return b"".join(form % tuple(value for part in row for value in part) for row in zip(*columns, strict=True))


def parse_records(items: tuple[int, ...], raw: NDArray[np.uint8], stylus_bytes: int = 2) -> NDArray[Any]:
    """Records (N,) of their bytes (N, size), which match `item_pattern`."""
    table = np.empty(len(raw), record_type(items, stylus_bytes))
    table["head"], table["station"], table["status"] = raw[:, 0], raw[:, 1], raw[:, 2]
    worth, scale, columns = _digit_weights(items, stylus_bytes)
    values = ((raw & 15) * (raw >= ord("0"))) @ worth / scale
    values[((raw == ord("-")) @ (worth > 0.0)) > 0] *= -1.0
    at = HEADER_BYTES
    for item, column in zip(resolve_items(items, stylus_bytes), columns, strict=True):
        block: NDArray[Any] = values[:, column] if item.width else raw[:, at : at + item.ascii_size]
        at += item.ascii_size
        table[item.name] = block.reshape(table[item.name].shape)
    return table


@lru_cache(maxsize=64)
def item_pattern(item: OutputItem) -> bytes:
    """A regular expression of just what a device may write for this item."""
    if item.kind == "u1" and item.width == 4:
        return _BYTE_PATTERN * item.count + b" " * item.blanks
    whole = item.width - (item.decimals + 1 if item.decimals else 0)
    shapes = [b" " * (whole - k) + rb"\d{%d}" % k for k in range(whole, 0, -1)]
    shapes += [b" " * (whole - k - 1) + rb"-\d{%d}" % k for k in range(whole - 1, 0, -1)]
    value = b"(?:" + b"|".join(shapes) + b")" + (rb"\.\d{%d}" % item.decimals if item.decimals else b"")
    return value * item.count + b" " * item.blanks


@lru_cache(maxsize=64)
def _digit_weights(items: tuple[int, ...], stylus_bytes: int) -> tuple[Floats, Floats, tuple[slice, ...]]:
    """What a digit in each byte of a record is worth in each of its V values (size, V), in units of the last decimal;
    how many such units make one (V,); and which of the values are each item's."""
    own = resolve_items(items, stylus_bytes)
    ends = list(accumulate((item.count if item.width else 0 for item in own), initial=0))
    columns = tuple(slice(begin, end) for begin, end in pairwise(ends))
    worth = np.zeros((HEADER_BYTES + sum(item.ascii_size for item in own), ends[-1]))
    scale, at = np.ones(ends[-1]), HEADER_BYTES
    for item, column in zip(own, columns, strict=True):
        scale[column] = 10.0**item.decimals
        for k, value in enumerate(range(column.start, column.stop)):
            worth[at + k * item.width : at + (k + 1) * item.width, value] = _place_values(item)
        at += item.ascii_size
    return worth, scale, columns


def _place_values(item: OutputItem) -> list[float]:
    """(width,) what a digit in each place is worth, in units of the last; 0 for the point."""
    digits = item.width - (item.decimals > 0)
    places = [10.0**k for k in reversed(range(digits))]
    return [*places[: digits - item.decimals], 0.0, *places[digits - item.decimals :]] if item.decimals else places


def _value_range(item: OutputItem) -> tuple[float, float]:
    """The largest and the smallest number that fit their columns."""
    step, whole = 10.0**-item.decimals, item.width - (item.decimals + 1 if item.decimals else 0)
    return 10.0**whole - step, -(10.0 ** (whole - 1)) + step


@lru_cache(maxsize=64)
def _format_string(items: tuple[int, ...], stylus_bytes: int) -> bytes:
    """A record as a format of `%`."""
    own = [
        b"%%%d.%df" % (item.width, item.decimals) * item.count + b" " * item.blanks if item.width else b"%b"
        for item in resolve_items(items, stylus_bytes)
    ]
    return b"0%c%c" + b"".join(own)
