"""ASCII records: rows of an output list's binary type as lines of fixed columns, and back (docs/is900.md 5.1).

Numbers are right-aligned in columns and may touch (`-12.50-100.00`), so they are cut by column, never at blanks. Items
of the 16-bit format have the same bytes as in binary.
"""

from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats
from harness.stream.codec.items import HEADER_BYTES, OutputItem, record_type, resolve_items

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
    weights, scale, columns = _digit_weights(items, stylus_bytes)
    values = ((raw & 15) * (raw >= ord("0"))) @ weights / scale
    values[((raw == ord("-")) @ (weights > 0.0)) > 0] *= -1.0
    offset = HEADER_BYTES
    for item, column in zip(resolve_items(items, stylus_bytes), columns, strict=True):
        block: NDArray[Any] = values[:, column] if item.width else raw[:, offset : offset + item.ascii_size]
        offset += item.ascii_size
        table[item.name] = block.reshape(table[item.name].shape)
    return table


@lru_cache(maxsize=64)
def item_pattern(item: OutputItem) -> bytes:
    """Return a regular expression that matches exactly what a device may write for this item."""
    if item.kind == "u1" and item.width == 4:
        return _BYTE_PATTERN * item.count + b" " * item.blanks
    integer_digits = item.width - (item.decimals + 1 if item.decimals else 0)
    alternatives = [b" " * (integer_digits - k) + rb"\d{%d}" % k for k in range(integer_digits, 0, -1)]
    alternatives += [b" " * (integer_digits - k - 1) + rb"-\d{%d}" % k for k in range(integer_digits - 1, 0, -1)]
    value = b"(?:" + b"|".join(alternatives) + b")" + (rb"\.\d{%d}" % item.decimals if item.decimals else b"")
    return value * item.count + b" " * item.blanks


@lru_cache(maxsize=64)
def _digit_weights(items: tuple[int, ...], stylus_bytes: int) -> tuple[Floats, Floats, tuple[slice, ...]]:
    """Return the layout of a record of `size` bytes with V values, as three arrays.

    The first (size, V) is the weight of a digit in each byte for each value, in units of the value's last decimal. The
    second (V,) is the number of such units in 1. The third gives the range of values of each item.
    """
    output_items = resolve_items(items, stylus_bytes)
    ends = list(accumulate((item.count if item.width else 0 for item in output_items), initial=0))
    columns = tuple(slice(begin, end) for begin, end in pairwise(ends))
    weights = np.zeros((HEADER_BYTES + sum(item.ascii_size for item in output_items), ends[-1]))
    scale, offset = np.ones(ends[-1]), HEADER_BYTES
    for item, column in zip(output_items, columns, strict=True):
        scale[column] = 10.0**item.decimals
        for k, value in enumerate(range(column.start, column.stop)):
            begin = offset + k * item.width
            weights[begin : begin + item.width, value] = _place_values(item)
        offset += item.ascii_size
    return weights, scale, columns


def _place_values(item: OutputItem) -> list[float]:
    """Return the (width,) weight of a digit in each column, in units of the last decimal; 0 for the decimal point."""
    digits = item.width - (item.decimals > 0)
    places = [10.0**k for k in reversed(range(digits))]
    return [*places[: digits - item.decimals], 0.0, *places[digits - item.decimals :]] if item.decimals else places


def _value_range(item: OutputItem) -> tuple[float, float]:
    """Return the largest and the smallest number that fit the columns of an item."""
    step, integer_digits = 10.0**-item.decimals, item.width - (item.decimals + 1 if item.decimals else 0)
    return 10.0**integer_digits - step, -(10.0 ** (integer_digits - 1)) + step


@lru_cache(maxsize=64)
def _format_string(items: tuple[int, ...], stylus_bytes: int) -> bytes:
    """Return the `%` format of a record."""
    output_items = [
        b"%%%d.%df" % (item.width, item.decimals) * item.count + b" " * item.blanks if item.width else b"%b"
        for item in resolve_items(items, stylus_bytes)
    ]
    return b"0%c%c" + b"".join(output_items)
