"""Readings in time: which sample of which lap is taken when, and what the device's clock says then."""

import numpy as np

from harness.core.arrays import Floats
from harness.stream.codec.samples import DeviceSamples

_SAME_TIME_S = 1e-9
"""Moments closer than this are one [s]."""


class SamplePlayer:
    """Rounds are counted from the beginning of the motion, through all laps; rows are stations."""

    def __init__(self, samples: DeviceSamples, now_s: float) -> None:
        self.samples = samples
        self._taken_s: list[list[float]] = samples.taken_s.tolist()
        self._lap_s, self._device_lap_s = samples.loop_s, samples.device_loop_s
        self._pace = self._device_lap_s / self._lap_s
        self.begin(now_s)

    def begin(self, now_s: float) -> None:
        """From the first instant, with the clock that belongs to it."""
        self._began_s, self._zero_s = now_s, 0.0

    def zero(self, now_s: float) -> None:
        """The clock is 0 now; the motion goes on."""
        self._zero_s = 0.0
        self._zero_s = self.clock_s(now_s)

    @property
    def epoch(self) -> tuple[float, float]:
        """Changes whenever stamps change their meaning."""
        return self._began_s, self._zero_s

    def clock_s(self, now_s: float) -> float:
        """What the device's clock says [s]."""
        first_s = float(self.samples.device_s[0, 0]) - self._pace * self._taken_s[0][0]
        return first_s + self._pace * (now_s - self._began_s) - self._zero_s

    def time_s(self, number: int, row: int) -> float:
        """When a reading is taken, by the clock of whoever asks [s]."""
        lap, k = divmod(number, len(self._taken_s))
        return self._began_s + lap * self._lap_s + self._taken_s[k][row]

    def first_from(self, now_s: float) -> int:
        """The first whole round that is still to come."""
        number = max(int((now_s - self._began_s) * self.samples.rate_hz) - 1, 0)
        while self.time_s(number, 0) < now_s - _SAME_TIME_S:
            number += 1
        return number

    def latest(self, now_s: float, row: int) -> int:
        """The round of the last reading of a station up to now; the first one before any."""
        number = int((now_s - self._began_s) * self.samples.rate_hz) + 1
        while number > 0 and self.time_s(number, row) > now_s + _SAME_TIME_S:
            number -= 1
        return max(number, 0)

    def stamps_s(self, number: int) -> Floats:
        """(S,) the device's clock at the readings of a round [s]."""
        lap, k = divmod(number, len(self._taken_s))
        out: Floats = self.samples.device_s[k] + lap * self._device_lap_s - self._zero_s
        return np.maximum(out, 0.0)

    def row_of(self, number: int) -> int:
        """The instant of a lap that a round plays."""
        return number % len(self._taken_s)
