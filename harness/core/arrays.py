"""Arrays in frozen records: converted, shape-checked and locked once, when the record is built."""

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
    """Replace the named fields of a frozen dataclass by read-only copies with the given shapes; ShapeError otherwise.

    An integer in a shape is an exact size. A string is a size that all fields with the same string must
    share. Two calls on one record agree about it when both name a common field.
    """
    sizes: dict[str, int] = {}
    for field, shape in shapes.items():
        array: NDArray[Any] = np.array(getattr(record, field), dtype=dtype, order="C")
        if array.ndim != len(shape) or any(
            size != (sizes.setdefault(wanted, size) if isinstance(wanted, str) else wanted)
            for size, wanted in zip(array.shape, shape, strict=True)
        ):
            expected = "(" + ", ".join(str(sizes.get(s, s) if isinstance(s, str) else s) for s in shape) + ")"
            raise ShapeError(type(record).__name__, field, array.shape, expected)
        array.setflags(write=False)
        object.__setattr__(record, field, array)
