"""A stretch of the wire as it was received: bytes, and when they came."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, Ints, freeze


@dataclass(frozen=True, eq=False)
class ByteCapture:
    """K chunks, one after another."""

    data: bytes
    ends: Ints
    """(K,) bytes received with the end of each chunk."""
    received_s: Floats
    """(K,) host clock at that moment [s]."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, ends=("K",))
        freeze(self, received_s=("K",))
