"""The device's clock as its records tell it: a float32 of milliseconds since it was set to zero (docs/is900.md 8)."""

import numpy as np

from harness.core.arrays import Floats

JUMP_S = 0.5
"""A stamp so much earlier than the one before means that the clock was set to zero."""


class DeviceClock:
    """Seconds that never start again: time goes on from where it was when the clock was zeroed."""

    def __init__(self) -> None:
        self._before_s = 0.0
        self._base_s = 0.0

    def unwrapped_s(self, stamps_ms: Floats) -> Floats:
        """(N,) seconds of successive stamps (N,) [ms]; small steps back are left for the assembler to doubt."""
        stamps_s = np.asarray(stamps_ms, dtype=float) / 1e3
        before = np.concatenate([[self._before_s], stamps_s[:-1]])
        jumps = np.where(stamps_s < before - JUMP_S, before, 0.0)
        out: Floats = stamps_s + self._base_s + np.cumsum(jumps)
        if len(stamps_s):
            self._before_s = float(stamps_s[-1])
            self._base_s += float(np.sum(jumps))
        return out
