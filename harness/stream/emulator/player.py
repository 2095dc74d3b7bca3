"""Timing of the played readings: which sample is taken when, and what the device's clock reads then."""

import numpy as np

from harness.core.arrays import Floats
from harness.stream.codec.samples import DeviceSamples

_SAME_TIME_S = 1e-9
"""Times closer than this count as equal [s]."""


class SamplePlayer:
    """Plays samples in a loop.

    Rounds are counted from the beginning of the motion through all loops; rows are stations.
    """

    def __init__(self, samples: DeviceSamples, now_s: float) -> None:
        self.samples = samples
        self._taken_s: list[list[float]] = samples.taken_s.tolist()
        self._loop_s, self._device_loop_s = samples.loop_s, samples.device_loop_s
        self._pace = self._device_loop_s / self._loop_s
        self.begin(now_s)

    def begin(self, now_s: float) -> None:
        """Start the motion at the first instant, with the clock of that instant."""
        self._began_s, self._zero_s = now_s, 0.0

    def zero(self, now_s: float) -> None:
        """Set the clock to 0 now; the motion continues."""
        self._zero_s = 0.0
        self._zero_s = self.clock_s(now_s)

    @property
    def epoch(self) -> tuple[float, float]:
        """A value that changes whenever the meaning of stamps changes."""
        return self._began_s, self._zero_s

    def clock_s(self, now_s: float) -> float:
        """Return the device's clock at `now_s` [s]."""
        first_s = float(self.samples.device_s[0, 0]) - self._pace * self._taken_s[0][0]
        return first_s + self._pace * (now_s - self._began_s) - self._zero_s

    def time_s(self, number: int, row: int) -> float:
        """Return when a reading is taken, on the clock of the caller [s]."""
        loop, k = divmod(number, len(self._taken_s))
        return self._began_s + loop * self._loop_s + self._taken_s[k][row]

    def first_from(self, now_s: float) -> int:
        """Return the number of the first whole round from `now_s` on."""
        number = max(int((now_s - self._began_s) * self.samples.rate_hz) - 1, 0)
        while self.time_s(number, 0) < now_s - _SAME_TIME_S:
            number += 1
        return number

    def latest(self, now_s: float, row: int) -> int:
        """Return the round of the latest reading of a station; round 0 before the first reading."""
        number = int((now_s - self._began_s) * self.samples.rate_hz) + 1
        while number > 0 and self.time_s(number, row) > now_s + _SAME_TIME_S:
            number -= 1
        return max(number, 0)

    def stamps_s(self, number: int) -> Floats:
        """Return the device's clock (S,) at the readings of a round [s]."""
        loop, k = divmod(number, len(self._taken_s))
        out: Floats = self.samples.device_s[k] + loop * self._device_loop_s - self._zero_s
        return np.maximum(out, 0.0)

    def instant_of(self, number: int) -> int:
        """Return the index of the instant that a round plays."""
        return number % len(self._taken_s)
