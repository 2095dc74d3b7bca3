"""Arrays in frozen records: converted, shape-checked and locked once, when the record is built."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.errors import ShapeError

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
"""Single precision, for what is kept in great numbers."""
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]


def freeze(record: Any, dtype: type = np.float64, **shapes: tuple[str | int, ...]) -> None:
    """Turn the named fields of a frozen dataclass into locked copies with the given shapes.

    A string in a shape stands for a size that every field naming it must share, `freeze` calls on one record
    included when they share a field; an integer is that size exactly. Raises ShapeError.
    """
    sizes: dict[str, int] = {}
    for field, shape in shapes.items():
        array: NDArray[Any] = np.array(getattr(record, field), dtype=dtype, order="C")
        if array.ndim != len(shape) or any(
            found != (sizes.setdefault(wanted, found) if isinstance(wanted, str) else wanted)
            for found, wanted in zip(array.shape, shape, strict=True)
        ):
            expected = "(" + ", ".join(str(sizes.get(s, s) if isinstance(s, str) else s) for s in shape) + ")"
            raise ShapeError(type(record).__name__, field, array.shape, expected)
        array.setflags(write=False)
        object.__setattr__(record, field, array)
