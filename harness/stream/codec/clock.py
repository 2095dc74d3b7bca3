"""Continuous device time from stamps of a clock that may be set to zero at any time and may be damaged.

Stamps are 32-bit floats in milliseconds (docs/is900.md 8), so their resolution degrades with the time since `MZ`: 0.001
ms after 10 s, 0.25 ms after an hour, 8 ms after a day. Nothing can restore it; setting the clock to zero again prevents
it.
"""

import numpy as np

from harness.core.arrays import Floats

CLOCK_TOLERANCE_S = 0.25
"""Delays of the host's reading vary by less than this, and no sound record is further out of sequence [s]."""
MAX_STAMP_S = 1e7
"""Stamps beyond this are damaged: 32-bit milliseconds have a step of one second there [s]."""


class ClockUnwrapper:
    """Converts stamps to seconds that continue where the clock was set back.

    A stamp is accepted when it did not step back and advanced no more than the host's clock, both within
    `CLOCK_TOLERANCE_S`. It is compared with the last accepted stamp and the one before. Other stamps are damaged (NaN),
    unless the next stamp agrees with them: then the device has reset its clock, and time continues from there by the
    host's clock.
    """

    def __init__(self) -> None:
        self._epoch_s = 0.0
        """Offset added to stamps [s]."""
        self._last: tuple[float, float] | None = None
        """Unwrapped stamp and host time of the last accepted record [s]."""
        self._previous: tuple[float, float] | None = None
        """Unwrapped stamp and host time of the accepted record before it, in case the last one was wrong [s]."""
        self._rejected: tuple[float, float] | None = None
        """Raw stamp and host time of the latest stamp, if it was not accepted [s]."""
        self.resets = 0
        """Number of times the clock was reset."""

    def unwrap(self, stamp_s: Floats, received_s: Floats) -> Floats:
        """Return continuous device time (N,) for stamps (N,) received at host times (N,) [s]; NaN for damaged ones."""
        out: Floats = stamp_s + self._epoch_s
        if len(out) == 0:
            return out
        if self._rejected is None and len(out) > 1:
            previous = self._last or (float(out[0]), float(received_s[0]))
            device, host = np.diff(out, prepend=previous[0]), np.diff(received_s, prepend=previous[1])
            if bool(np.all((device > -CLOCK_TOLERANCE_S) & (device < host + CLOCK_TOLERANCE_S))):
                self._previous = float(out[-2]), float(received_s[-2])
                self._last = float(out[-1]), float(received_s[-1])
                return out
        for i, (stamp, received) in enumerate(zip(stamp_s.tolist(), received_s.tolist(), strict=True)):
            out[i] = self._unwrap_one(stamp, received)
        return out

    def _unwrap_one(self, stamp_s: float, received_s: float) -> float:
        if not 0.0 <= stamp_s < MAX_STAMP_S:
            return float("nan")
        now_s = stamp_s + self._epoch_s
        accepted = [record for record in (self._last, self._previous) if record is not None]
        if self._last is None or any(_is_same_clock(record, (now_s, received_s)) for record in accepted):
            self._previous, self._last, self._rejected = self._last, (now_s, received_s), None
            return now_s
        if self._rejected is not None and _is_same_clock(self._rejected, (stamp_s, received_s)):
            self._epoch_s = self._last[0] + (received_s - self._last[1]) - stamp_s
            self.resets += 1
            self._previous, self._last, self._rejected = None, (stamp_s + self._epoch_s, received_s), None
            return self._last[0]
        self._rejected = stamp_s, received_s
        return float("nan")


def _is_same_clock(previous: tuple[float, float], current: tuple[float, float]) -> bool:
    """Whether two (device, host) time pairs may belong to the same running clock."""
    return -CLOCK_TOLERANCE_S < current[0] - previous[0] < current[1] - previous[1] + CLOCK_TOLERANCE_S
