"""Arrays in frozen records: converted, shape-checked and made immutable once, when the record is built."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.errors import ShapeError

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
"""Single precision, for large arrays."""
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]


def freeze(record: Any, dtype: type = np.float64, **shapes: tuple[str | int, ...]) -> None:
    """Replace the named fields of a frozen dataclass by immutable copies with the given shapes; ShapeError otherwise.

    An integer in a shape is an exact size. A string is a size that all fields with the same string must
    share. Two calls on one record agree about it when both name a common field.
    """
    sizes: dict[str, int] = {}
    for field, shape in shapes.items():
        array = immutable(getattr(record, field), dtype)
        if array.ndim != len(shape) or any(
            size != (sizes.setdefault(wanted, size) if isinstance(wanted, str) else wanted)
            for size, wanted in zip(array.shape, shape, strict=True)
        ):
            expected = "(" + ", ".join(str(sizes.get(s, s) if isinstance(s, str) else s) for s in shape) + ")"
            raise ShapeError(type(record).__name__, field, array.shape, expected)
        object.__setattr__(record, field, array)


def immutable(values: Any, dtype: type = np.float64) -> NDArray[Any]:
    """A copy that nobody can make writable again, because its memory is a `bytes` object; such an array as it is.

    TypeError for floats from complex numbers, objects, text or masked values. ValueError for finite numbers that are
    too large for the type.
    """
    if type(values) is np.ndarray and values.dtype == dtype and values.flags.c_contiguous:
        memory: object = values.base
        if type(memory) is bytes:
            return values
    given = np.asanyarray(values)
    if np.dtype(dtype).kind == "f" and not np.can_cast(given.dtype, dtype, "same_kind"):
        raise TypeError(f"values of type {given.dtype}, expected {np.dtype(dtype)}")
    if np.ma.is_masked(given):
        raise TypeError("masked values, which are no numbers")
    with np.errstate(over="ignore"):
        array: NDArray[Any] = np.asarray(given, dtype=dtype, order="C")
    narrower = given.dtype.kind == "f" and given.dtype.itemsize > array.itemsize
    if narrower and not np.array_equal(np.isfinite(given), np.isfinite(array)):
        raise ValueError(f"a number that is too large for {array.dtype}")
    return np.ndarray(array.shape, array.dtype, array.tobytes())


def find_runs(condition: Bools) -> Ints:
    """(N, 2) index of the first sample of each run of True in an array (T,), and of the first sample after it."""
    edges = np.diff(np.concatenate([[False], condition, [False]]).astype(np.int8))
    return np.stack([np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)], axis=1).astype(np.int64)
