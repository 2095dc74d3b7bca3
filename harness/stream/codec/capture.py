"""A stretch of received bytes with their times."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, Ints, freeze


@dataclass(frozen=True, eq=False)
class ByteCapture:
    """K consecutive chunks of received bytes."""

    data: bytes
    ends: Ints
    """(K,) number of bytes received up to the end of each chunk."""
    received_s: Floats
    """(K,) host clock when each chunk was received [s]."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, ends=("K",))
        freeze(self, received_s=("K",))
