"""Messages between processes: a JSON header and arrays of numbers. A message cannot carry code, unlike a pickle."""

import json
import math
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import immutable
from harness.core.files import to_json_types

Arrays = Mapping[str, NDArray[Any]]

_DTYPES = ("<f8", "<i8", "|b1")
_LENGTH_BYTES = 8
_MAX_HEADER_BYTES = 1 << 24


class MessageError(Exception):
    """A message that ends too early, is too long, or is none."""


def write_message(file: BinaryIO, header: Mapping[str, Any], arrays: Arrays | None = None) -> None:
    """Write a message and flush it; arrays are float64, int64 or bool. OSError when the reader is gone."""
    values = {name: immutable(array, _kind(array)) for name, array in (arrays or {}).items()}
    described = [[name, array.dtype.str, list(array.shape)] for name, array in values.items()]
    text = json.dumps({"header": to_json_types(header), "arrays": described}).encode()
    file.write(len(text).to_bytes(_LENGTH_BYTES, "little") + text)
    for array in values.values():
        file.write(array.data if array.size else b"")
    file.flush()


def read_message(file: BinaryIO, max_bytes: float = math.inf) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Read the header and the arrays, which are immutable, of a message of at most `max_bytes`; MessageError."""
    length = int.from_bytes(_read(file, _LENGTH_BYTES), "little")
    if length > min(_MAX_HEADER_BYTES, max_bytes):
        raise MessageError(f"a header of {length} bytes")
    try:
        content = json.loads(_read(file, length))
        header, described = dict(content["header"]), list(content["arrays"])
        arrays = {}
        for name, dtype, shape in described:
            if dtype not in _DTYPES or not all(type(size) is int and size >= 0 for size in shape):
                raise MessageError(f"an array of type {dtype!r:.40} and shape {shape!r:.80}")
            size = math.prod(shape) * np.dtype(dtype).itemsize
            max_bytes -= size
            if max_bytes < 0:
                raise MessageError("more numbers than expected")
            arrays[str(name)] = np.ndarray(shape, dtype, _read(file, size))
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise MessageError(f"no message ({type(error).__name__})") from error
    return header, arrays


def _kind(array: NDArray[Any]) -> type:
    return {"b": np.bool_, "i": np.int64, "u": np.int64}.get(array.dtype.kind, np.float64)


def _read(file: BinaryIO, size: int) -> bytes:
    data = file.read(size)
    if len(data) < size:
        raise MessageError("the end of the stream")
    return data
