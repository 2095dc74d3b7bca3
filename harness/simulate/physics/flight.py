"""Time of flight of sound from a fixed source to a moving microphone."""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled

_SETTLED_S = 1e-14
_MOST_STEPS = 50


@compiled
def time_of_flight_s(source_m: Floats, position_m: Floats, velocity_m_s: Floats, tick_s: float, speed: float) -> float:
    """Time until sound from a point reaches a microphone [s]; NaN if that is later than the last tick.

    The sound leaves at the first of K ticks. The microphone's positions and velocities at the ticks, (K, 3) each, are
    joined by cubic polynomials (Hermite). `speed` is the speed of sound [m/s], much higher than the microphone's.
    """
    last = len(position_m) - 1
    time_s = 0.0
    for _ in range(_MOST_STEPS):
        tick = min(int(time_s / tick_s), last - 1)
        x = time_s / tick_s - tick
        # Weights of the positions and velocities at both ends of the interval.
        p1 = x * x * (3.0 - 2.0 * x)
        v0, v1 = tick_s * x * (1.0 - x) * (1.0 - x), tick_s * x * x * (x - 1.0)
        squared = 0.0
        for axis in range(3):
            begin, end = position_m[tick, axis], position_m[tick + 1, axis]
            at_m = begin + p1 * (end - begin) + v0 * velocity_m_s[tick, axis] + v1 * velocity_m_s[tick + 1, axis]
            squared += (at_m - source_m[axis]) ** 2
        before_s, time_s = time_s, np.sqrt(squared) / speed
        if time_s > last * tick_s:
            # One step later is not yet proof: the microphone may come nearer. The end of the slot is the latest time.
            if before_s == last * tick_s:
                return np.nan
            time_s = last * tick_s
        elif abs(time_s - before_s) <= _SETTLED_S:
            break
    return time_s
