"""Errors that come and go: excursions, echoes and dropouts."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats
from harness.core.ranges import CheckedFields, Range, check_fields
from harness.simulate.readings import GRAVITY_M_S2, SimulatedReadings

MOST_EXCURSIONS = 1000.0
"""Most excursions of one station at once, on average [choice]; each is drawn."""
_WARM_UP = 64
"""Readings simulated before the take, so that it may begin inside a burst."""
MOST_GAPS_PER_S = 100.0
"""Most gaps of one station in a second, on average [choice]; each is drawn."""


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
        check_fields(self, onsets_per_min=Range(0.0, MOST_EXCURSIONS / max(longest_min, 1e-3)))

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


@dataclass(frozen=True)
class Echo(CheckedFields):
    """Bursts of readings that are displaced in one direction, each burst by its own distance.

    A reflection lengthens a range and never shortens it (National Academy Press; rate and size are inferred,
    docs/is900.md 13.3 and 13.5). `share` is the "outlier rate" of the studies.
    """

    share: Annotated[float, Range(0.0, 0.99)] = 0.03
    """Share of station readings that are outliers, 0 to below 1."""
    burst_records: Annotated[tuple[int, int], Range(1, 100_000, ascending=True)] = (1, 8)
    """Fewest and most readings in a burst; uniform."""
    size_m: Annotated[tuple[float, float], Range(0.0, 10.0, ascending=True)] = (0.05, 0.30)
    """Smallest and largest displacement [m]; uniform."""

    def apply(self, readings: SimulatedReadings) -> None:
        hit = np.zeros(readings.time_s.shape, bool)
        if self.share > 0.0:
            for row, station in enumerate(readings.stations):
                self._add_bursts(readings, hit, row, readings.take_rng("echo", station))
        readings.affected["echo"] = hit

    def _add_bursts(self, readings: SimulatedReadings, hit: np.ndarray, row: int, rng: np.random.Generator) -> None:
        fewest, most = self.burst_records
        clean = 0.5 * (fewest + most) * (1.0 - self.share) / self.share
        at = -_WARM_UP
        while at < len(hit):
            at += int(rng.geometric(1.0 / (1.0 + clean))) - 1
            burst = slice(max(at, 0), max(at := at + int(rng.integers(fewest, most + 1)), 0))
            readings.position_m[burst, row] += rng.uniform(*self.size_m) * direction(rng)
            hit[burst, row] = True


@dataclass(frozen=True)
class Dropout:
    """Gaps of quality 0, each after a period of falling quality and growing error.

    While the station coasts, a tilt error leaks gravity into the horizontal: 0.5 g sin(tilt) t^2 (docs/is900.md 13.4).
    During the gap, records repeat the filter's last state (section 7). Share and lengths are inferred (13.5).
    """

    share: Annotated[float, Range(0.0, 0.99)] = 0.01
    """Share of station readings with quality 0, 0 to below 1."""
    gap_s: Annotated[tuple[float, float], Range(1e-3, 1e6, ascending=True)] = (0.1, 0.5)
    """Shortest and longest gap [s]."""
    coast_s: Annotated[float, Range(1e-3, 60.0)] = 0.5
    """Time without ranges before each gap, at most since the previous gap [s]."""
    tilt_rad: Annotated[float, Range(0.0, 1.0)] = float(np.deg2rad(0.25))
    """Tilt error while coasting [rad]: the RMS of pitch and roll."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_fields(self, share=Range(0.0, MOST_GAPS_PER_S * 0.5 * sum(self.gap_s)))

    def apply(self, readings: SimulatedReadings) -> None:
        lost = np.zeros(readings.time_s.shape, bool)
        coasting = np.zeros(readings.time_s.shape, bool)
        leak_m_s2 = GRAVITY_M_S2 * float(np.sin(self.tilt_rad))
        for row, station in enumerate(readings.stations):
            time_s, sighted_s = readings.time_s[:, row], -np.inf
            for begin_s, end_s, sideways in self.gaps(readings.take_rng("dropout", station), float(time_s.max())):
                blocked_s = max(begin_s - self.coast_s, sighted_s)
                coast = (time_s >= blocked_s) & (time_s < begin_s)
                coasted_s = time_s[coast] - blocked_s
                readings.position_m[coast, row] += leak_m_s2 * 0.5 * coasted_s[:, None] ** 2 * sideways
                left = 1.0 - coasted_s / self.coast_s
                readings.quality[coast, row] = np.minimum(readings.quality[coast, row], np.maximum(left, 1.0 / 255.0))
                coasting[:, row] |= coast
                lost[:, row] |= (time_s >= begin_s) & (time_s < end_s)
                sighted_s = end_s
        readings.hold_last_valid(lost)
        readings.affected["coast"] = coasting & ~lost

    def gaps(self, rng: np.random.Generator, until_s: float) -> list[tuple[float, float, Floats]]:
        """Begin and end [s] of each gap up to `until_s`, and the horizontal unit vector (3,) of the error before it."""
        gaps: list[tuple[float, float, Floats]] = []
        if self.share <= 0.0:
            return gaps
        between_s = 0.5 * sum(self.gap_s) * (1.0 - self.share) / self.share
        end_s = -5.0 * between_s
        while (begin_s := end_s + rng.exponential(between_s)) < until_s + self.coast_s:
            end_s, angle = begin_s + rng.uniform(*self.gap_s), rng.uniform(0.0, 2.0 * np.pi)
            gaps.append((begin_s, end_s, np.array([np.cos(angle), np.sin(angle), 0.0])))
        return [gap for gap in gaps if gap[1] > 0.0]
