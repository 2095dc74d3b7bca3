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
    """A copy that nobody can make writable again, because its memory is a `bytes` object; such an array as it is."""
    if type(values) is np.ndarray and values.dtype == dtype and values.flags.c_contiguous:
        memory: object = values.base
        if type(memory) is bytes:
            return values
    array: NDArray[Any] = np.asarray(values, dtype=dtype, order="C")
    return np.ndarray(array.shape, array.dtype, array.tobytes())
