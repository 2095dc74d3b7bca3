"""The device's clock made continuous: it may be set to zero at any time, and single stamps may be damaged.

Stamps are 32-bit floats of milliseconds (docs/is900.md 8), so their resolution falls with the time since `MZ`:
0.001 ms after 10 s, 0.25 ms after an hour, 8 ms after a day. Nothing can restore that; re-zeroing can prevent it.
"""

import numpy as np

from harness.core.arrays import Floats

CLOCK_TOLERANCE_S = 0.25
"""Delays of the host's reading differ by less than this [s]; no sound record is farther out of order."""
MAX_STAMP_S = 1e7
"""By then, 32-bit milliseconds have a step of a second: a stamp beyond is a damaged number [s]."""


class ClockUnwrapper:
    """Turns stamps into seconds that go on where the clock was set back.

    A stamp is believed when, since the last one believed or the one before, it did not step back and advanced no more
    than the host's clock did, both within `CLOCK_TOLERANCE_S`. Others are damaged (NaN), unless the next stamp agrees with
    them: then the device set its clock anew, and time goes on from there by the host's clock.
    """

    def __init__(self) -> None:
        self._epoch_s = 0.0
        """Added to stamps."""
        self._last: tuple[float, float] | None = None
        """Unwrapped stamp and host time of the last record believed [s]."""
        self._before: tuple[float, float] | None = None
        """The same of the one before, in case the last one should not have been believed."""
        self._odd: tuple[float, float] | None = None
        """Raw stamp and host time of the last one, where it was not believed [s]."""
        self.resets = 0
        """How often the clock was set anew."""

    def unwrap(self, stamp_s: Floats, received_s: Floats) -> Floats:
        """Continuous device time (N,) of stamps (N,) received at these host times (N,) [s]; NaN for damaged ones."""
        out: Floats = stamp_s + self._epoch_s
        if len(out) == 0:
            return out
        if self._odd is None and len(out) > 1:
            before = self._last or (float(out[0]), float(received_s[0]))
            device, host = np.diff(out, prepend=before[0]), np.diff(received_s, prepend=before[1])
            if bool(np.all((device > -CLOCK_TOLERANCE_S) & (device < host + CLOCK_TOLERANCE_S))):
                self._before = float(out[-2]), float(received_s[-2])
                self._last = float(out[-1]), float(received_s[-1])
                return out
        for i, (stamp, received) in enumerate(zip(stamp_s.tolist(), received_s.tolist(), strict=True)):
            out[i] = self._one(stamp, received)
        return out

    def _one(self, stamp_s: float, received_s: float) -> float:
        if not 0.0 <= stamp_s < MAX_STAMP_S:
            return float("nan")
        now_s = stamp_s + self._epoch_s
        believed = [known for known in (self._last, self._before) if known is not None]
        if self._last is None or any(_is_same_clock(known, (now_s, received_s)) for known in believed):
            self._before, self._last, self._odd = self._last, (now_s, received_s), None
            return now_s
        if self._odd is not None and _is_same_clock(self._odd, (stamp_s, received_s)):
            self._epoch_s = self._last[0] + (received_s - self._last[1]) - stamp_s
            self.resets += 1
            self._before, self._last, self._odd = None, (stamp_s + self._epoch_s, received_s), None
            return self._last[0]
        self._odd = stamp_s, received_s
        return float("nan")


def _is_same_clock(before: tuple[float, float], now: tuple[float, float]) -> bool:
    """Whether device and host time (each) may belong to the same running clock."""
    return -CLOCK_TOLERANCE_S < now[0] - before[0] < now[1] - before[1] + CLOCK_TOLERANCE_S
