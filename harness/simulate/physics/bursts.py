"""Bursts of noise in the band of the ultrasound, which every station hears."""

from functools import lru_cache

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.seeds import generator

_MINUTE_S = 60.0


class Bursts:
    """The bursts of one take, as a Poisson process over all times, before the take too.

    Each minute has its own random draws, so that a burst does not depend on when the simulation begins.
    """

    def __init__(self, per_min: float, duration_s: tuple[float, float], *, seed: int, take: str) -> None:
        self._per_min, self._duration_s = per_min, duration_s
        self._seed, self._take = seed, take
        self._in_minute = lru_cache(maxsize=8)(self._draw)

    def intervals_s(self, from_s: float, to_s: float) -> Floats:
        """(N, 2) beginning and end of every burst that may touch the time between two instants [s]."""
        first, last = (int(np.floor(at_s / _MINUTE_S)) for at_s in (from_s - self._duration_s[1], to_s))
        return np.concatenate([self._in_minute(minute) for minute in range(first, last + 1)])

    def touch(self, from_s: Floats, to_s: Floats) -> Bools:
        """(F,) whether a burst touches each of F ascending intervals [s]."""
        out = np.zeros(len(from_s), dtype=bool)
        if self._per_min > 0.0 and len(from_s):
            for begins_s, ends_s in self.intervals_s(float(from_s[0]), float(to_s[-1])):
                out |= (begins_s < to_s) & (ends_s > from_s)
        return out

    def _draw(self, minute: int) -> Floats:
        rng = generator(self._seed, "physics", self._take, "bursts", minute)
        count = int(rng.poisson(self._per_min))
        begins_s = _MINUTE_S * (minute + rng.random(count))
        return np.stack([begins_s, begins_s + rng.uniform(*self._duration_s, count)], axis=1)
