"""Ultrasound: its level and time of flight, reflections, bursts of noise, and the settings of all of these.

A level is in dB relative to 1 m on the axes of emitter and microphone. The noise of a range follows from it, and the
device's filter assumes the same law. The echo of a plane comes as if from the mirror image (docs/is900.md 16).
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.ranges import Range, check_fields
from harness.core.seeds import generator
from harness.errors import BadInput

MICROPHONES = 2
"""Number of microphones of a station (docs/is900.md 7)."""
Point = Annotated[tuple[float, float, float], Range(-1.0, 1.0)]
NOISE_AT_M = 2.0
"""Distance on the axes for which the noise of a range is specified [m]."""
_LEAST_NOISE, _LARGEST_NOISE = 0.5, 4.0
"""Limits of the factor on the noise of a range [choice]."""
_LEAST_AMPLITUDE = 1e-6
_CONVERGENCE_S = 1e-14
_MOST_STEPS = 50
_MINUTE_S = 60.0


@dataclass(frozen=True)
class Sound:
    """Speed and level of sound, the microphones of a station, and the errors of a range."""

    temperature_c: Annotated[float, Range(-40.0, 60.0)] = 20.0
    """Mean temperature of the air [deg C] [choice]."""
    temperature_sd_c: Annotated[float, Range(0.0, 20.0)] = 0.6
    """Standard deviation of the temperature between sessions [K]: a scale error of 0.1 % (docs/is900.md 13.5)."""
    assumed_c: Annotated[float, Range(-40.0, 60.0)] = 20.0
    """Temperature for which the device computes the speed of sound [deg C] [choice]."""
    range_noise_m: Annotated[float, Range(0.0, 1.0)] = 0.00075
    """Standard deviation of a range at 2 m on the axis of emitter and microphone [m]. It grows as the amplitude falls,
    to about 1.5 mm in the mean. Chosen because the position at rest then varies by about the published 1.5 mm
    (docs/is900.md 13.1)."""
    wrong_cycle_share: Annotated[float, Range(0.0, 1.0)] = 0.01
    """Share of ranges at 2 m on the axis that are one wavelength too long (docs/is900.md 13.3); it grows likewise
    [choice]."""
    frequency_hz: Annotated[float, Range(1e3, 1e6)] = 40e3
    """Frequency (docs/is900.md 13.1)."""
    absorption_db_per_m: Annotated[float, Range(0.0, 100.0)] = 1.3
    """Absorption of the air at 40 kHz, 20 deg C and 50 % humidity [dB/m] (ISO 9613-1)."""
    air_speed_sd_m_s: Annotated[float, Range(0.0, 20.0)] = 0.05
    """Standard deviation of the air's speed along each path [m/s] [choice]."""
    air_correlation_s: Annotated[float, Range(1e-2, 1e6)] = 5.0
    """Time after which the correlation of that speed is 1/e [s] [choice]."""
    bursts_per_min: Annotated[float, Range(0.0, 600.0)] = 2.0
    """Mean number of bursts of noise in the band, such as jingling keys (docs/is900.md 13.3) [choice]."""
    burst_s: Annotated[tuple[float, float], Range(0.0, 60.0, ascending=True)] = (0.02, 0.1)
    """Shortest and longest burst [s] [choice]."""
    microphones_m: tuple[Point, ...] = ((0.0, 0.03, 0.01), (0.0, -0.03, 0.01))
    """Positions of the two microphones in the station's axes [m]. The manual has two (docs/is900.md 7). They lie across
    the bone, so that the ranges fix the heading of a station on an upright bone [choice]."""
    microphone_sd_m: Annotated[float, Range(0.0, 0.1)] = 0.00025
    """Standard deviation of a microphone's place on each axis about the one that the device assumes, for a session [m]:
    0.7 us of sound. Chosen because the yaw then has the published accuracy (docs/is900.md 13.1)."""

    def __post_init__(self) -> None:
        check_fields(self)
        if len(self.microphones_m) != MICROPHONES:
            raise BadInput(
                f"sound.microphones_m has {len(self.microphones_m)} positions.", f"A station has {MICROPHONES}."
            )


def speed_of_sound_m_s(temperature_c: float) -> float:
    """Speed of sound in dry air at a temperature [deg C]: 331.3 m/s at 0 deg C, as the root of the absolute one."""
    return 331.3 * math.sqrt(1.0 + temperature_c / 273.15)


@compiled
def level_db(distance_m: float, cos_emitter: float, cos_station: float, absorption_db_per_m: float) -> float:
    """Level after a distance [dB]; the cosines are of the angles from the emitter's normal and the station's z.

    The amplitude falls with distance, with absorption in the air [dB/m], with the cosine at the emitter, and at the
    microphone with half of one plus the cosine (a choice).
    """
    amplitude = max(cos_emitter, _LEAST_AMPLITUDE) * max(0.5 + 0.5 * cos_station, _LEAST_AMPLITUDE)
    return 20.0 * math.log10(amplitude / max(distance_m, _LEAST_AMPLITUDE)) - absorption_db_per_m * (distance_m - 1.0)


@compiled
def threshold_db(range_m: float, cone_rad: float, absorption_db_per_m: float) -> float:
    """Lowest level that is heard [dB]: at the largest range, at the cone's edge, with the microphone facing it."""
    return level_db(range_m, math.cos(cone_rad), 1.0, absorption_db_per_m)


@compiled
def noise_factor(level: float, absorption_db_per_m: float) -> float:
    """Noise of a range at a level [dB], relative to that at 2 m on the axes: the inverse amplitude, from 0.5 to 4."""
    reference_db = level_db(NOISE_AT_M, 1.0, 1.0, absorption_db_per_m)
    factor: float = 10.0 ** ((reference_db - level) / 20.0)
    return min(max(factor, _LEAST_NOISE), _LARGEST_NOISE)


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
        elif abs(time_s - before_s) <= _CONVERGENCE_S:
            break
    return time_s


def mirror_images(planes: Floats, position_m: Floats) -> Floats:
    """(J, P, 3) images of J points in P planes; a plane is its unit normal and its distance from the origin [m]."""
    normal, distance_m = planes[:, :3], planes[:, 3]
    beyond_m = np.sum(position_m[:, None] * normal, axis=-1) - distance_m
    out: Floats = position_m[:, None] - 2.0 * beyond_m[..., None] * normal
    return out


@compiled
def reflection_point(plane: Floats, image_m: Floats, to_m: Floats, out: Floats) -> bool:
    """Where a ray from a mirror image (3,) to a point (3,) passes the plane (4,) [m]; False if it does not."""
    before = plane[0] * image_m[0] + plane[1] * image_m[1] + plane[2] * image_m[2] - plane[3]
    after = plane[0] * to_m[0] + plane[1] * to_m[1] + plane[2] * to_m[2] - plane[3]
    if not before * after < 0.0:
        return False
    share = before / (before - after)
    for axis in range(3):
        out[axis] = image_m[axis] + share * (to_m[axis] - image_m[axis])
    return True


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

    def overlaps(self, from_s: Floats, to_s: Floats) -> Bools:
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
