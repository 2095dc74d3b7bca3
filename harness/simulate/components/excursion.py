"""Position errors of several seconds that come and go."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats
from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings

MOST_AT_ONCE = 1000.0
"""Most excursions of one station at once, on average [choice]; each is drawn."""


@dataclass(frozen=True)
class Excursion:
    """Position errors of up to 3 cm that last several seconds (Gilson et al. 2006; the rate is inferred).

    Onsets are a Poisson process for each station that began before the take. Size, duration and direction are uniform
    and drawn for each onset. Overlapping excursions add up, limited to the largest size.
    """

    onsets_per_min: Annotated[float, Range(0.0, 600.0)] = 1.0
    """Mean number of onsets per minute and station."""
    size_m: Annotated[tuple[float, float], Range(0.0, 10.0, ascending=True)] = (0.005, 0.03)
    """Smallest and largest displacement [m]."""
    stay_s: Annotated[tuple[float, float], Range(0.0, 1e6, ascending=True)] = (1.0, 5.0)
    """Shortest and longest time from onset to the beginning of the return [s]."""
    ramp_s: Annotated[float, Range(0.0, 60.0)] = 0.2
    """Length of the rise and of the return [s]."""

    def __post_init__(self) -> None:
        check_fields(self)
        longest_min = (self.stay_s[1] + self.ramp_s) / 60.0
        check_fields(self, onsets_per_min=Range(0.0, MOST_AT_ONCE / max(longest_min, 1e-3)))

    def apply(self, readings: SimulatedReadings) -> None:
        hit = np.zeros(readings.time_s.shape, bool)
        for row, station in enumerate(readings.stations):
            time_s = readings.time_s[:, row]
            offset_m = np.zeros((len(time_s), 3))
            for begin_s, stay_s, full_offset_m in self.events(
                readings.take_rng("excursion", station), float(time_s.max())
            ):
                share = self.ramp(time_s - begin_s, stay_s)
                offset_m += share[:, None] * full_offset_m
                hit[:, row] |= share > 0.0
            largest_m = max(self.size_m[1], 1e-12)
            size_m = np.sqrt(np.sum(offset_m**2, axis=1, keepdims=True))
            readings.position_m[:, row] += offset_m * (largest_m / np.maximum(size_m, largest_m))
        readings.affected["excursion"] = hit

    def events(self, rng: np.random.Generator, until_s: float) -> list[tuple[float, float, Floats]]:
        """Onset [s], stay [s] and offset (3,) [m] of each excursion that overlaps the time from 0 to `until_s`."""
        events: list[tuple[float, float, Floats]] = []
        if self.onsets_per_min <= 0.0:
            return events
        begin_s = -(self.stay_s[1] + self.ramp_s)
        while (begin_s := begin_s + rng.exponential(60.0 / self.onsets_per_min)) < until_s:
            stay_s, size_m = rng.uniform(*self.stay_s), rng.uniform(*self.size_m)
            events.append((begin_s, stay_s, size_m * direction(rng)))
        return events

    def ramp(self, since_s: Floats, stay_s: float) -> Floats:
        """Share (N,) of the offset, 0 to 1, at these times after the onset [s]."""
        ramp_s = max(self.ramp_s, 1e-9)
        return np.clip(np.minimum(since_s, stay_s + ramp_s - since_s) / ramp_s, 0.0, 1.0)


def direction(rng: np.random.Generator) -> Floats:
    """A random unit vector (3,), uniform on the sphere."""
    v = rng.normal(size=3)
    out: Floats = v / np.sqrt(v @ v)
    return out
