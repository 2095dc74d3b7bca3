"""Errors that come and go: excursions, echoes, short losses, lost stations, slipping straps.

Default numbers: docs/is900.md 13.5. None is a measurement of a unit.
"""

from dataclasses import dataclass, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import UnknownName
from harness.simulate.readings import Draw, Readings, per_station

_GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Excursion:
    """Off by up to 3 cm for seconds, then back; not tied to acceleration (Gilson et al. 2006; rate ours)."""

    per_minute: float = 1.0
    """Mean onsets for each station."""
    smallest_m: float = 0.005
    largest_m: float = 0.03
    shortest_s: float = 1.0
    longest_s: float = 5.0
    ramp_s: float = 0.2
    """From nothing to the full size, and back; within the length."""

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        offset = per_station(seen, draw, lambda rng: self._offset(rng, len(seen.time_s) / seen.rate_hz, seen.rate_hz))
        return replace(
            seen,
            position_m=seen.position_m + offset,
            marks=seen.marked("excursion", np.any(offset != 0.0, axis=2)),
        )

    def _offset(self, rng: np.random.Generator, duration_s: float, rate_hz: float) -> Floats:
        """(E, 3); onsets begin one longest length before the take, so that its start is like its middle."""
        time_s = np.arange(round(duration_s * rate_hz)) / rate_hz
        span_s = duration_s + self.longest_s
        offset = np.zeros((len(time_s), 3))
        for start_s in np.sort(rng.uniform(-self.longest_s, duration_s, rng.poisson(self.per_minute * span_s / 60.0))):
            size_m = rng.uniform(self.smallest_m, self.largest_m)
            length_s = rng.uniform(self.shortest_s, self.longest_s)
            into_s = np.minimum(time_s - start_s, start_s + length_s - time_s)
            offset += np.clip(into_s / self.ramp_s, 0.0, 1.0)[:, None] * size_m * _direction(rng)
        return offset


@dataclass(frozen=True)
class Echo:
    """Sound that came round an obstacle: bursts of far-off positions, away from one direction (rate and size ours)."""

    share: float = 0.03
    """Of a station's readings: the outlier rate."""
    longest_burst: int = 8
    """Records; lengths are even from 1 to this."""
    smallest_m: float = 0.05
    largest_m: float = 0.30

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        offset = per_station(seen, draw, lambda rng: self._offset(rng, len(seen.time_s)))
        hit = np.any(offset != 0.0, axis=2)
        return replace(seen, position_m=seen.position_m + offset, marks=seen.marked("echo", hit))

    def _offset(self, rng: np.random.Generator, count: int) -> Floats:
        offset = np.zeros((count, 3))
        for start, stop in bursts(rng, count, self.share, 1, self.longest_burst):
            direction = _direction(rng)
            sizes_m = rng.uniform(self.smallest_m, self.largest_m, stop - start)
            offset[start:stop] = sizes_m[:, None] * direction
        return offset


@dataclass(frozen=True)
class Dropout:
    """Line of sight blocked: it coasts on inertia while quality falls, then is lost for a moment (rate ours)."""

    share: float = 0.01
    """Of a station's readings that are lost."""
    shortest_s: float = 0.1
    longest_s: float = 0.5
    coast_s: float = 0.5
    """Coasting before the loss; the error grows by 0.5 g sin(tilt) t^2 (docs/is900.md 13.4)."""
    tilt_deg: float = 0.25

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        shortest, longest = (max(round(t * seen.rate_hz), 1) for t in (self.shortest_s, self.longest_s))
        count = len(seen.time_s)
        columns = [self._column(draw(s), count, seen.rate_hz, shortest, longest) for s in seen.stations]
        offset, quality = (np.stack(parts, axis=1) for parts in zip(*columns, strict=True))
        return replace(
            seen,
            position_m=seen.position_m + offset,
            quality=np.minimum(seen.quality, quality),
            marks=seen.marked("dropout", quality == 0.0),
        )

    def _column(
        self, rng: np.random.Generator, count: int, rate_hz: float, shortest: int, longest: int
    ) -> tuple[Floats, Floats]:
        """(E, 3) drift and (E,) quality of one station."""
        drift, quality = np.zeros((count, 3)), np.ones(count)
        coast = round(self.coast_s * rate_hz)
        growth_m_s2 = 0.5 * _GRAVITY_M_S2 * np.sin(np.deg2rad(self.tilt_deg))
        for start, stop in bursts(rng, count, self.share, shortest, longest):
            heading = rng.uniform(0.0, 2.0 * np.pi)
            blocked = np.arange(max(start - coast, 0), min(stop, count))
            since_s = (blocked - (start - coast)) / rate_hz
            drift[blocked] = growth_m_s2 * since_s[:, None] ** 2 * [np.cos(heading), np.sin(heading), 0.0]
            if coast:
                quality[blocked] = np.clip(1.0 - 0.9 * since_s / self.coast_s, 0.1, 1.0)
            quality[max(start, 0) : stop] = 0.0
        return drift, quality


@dataclass(frozen=True)
class LostStation:
    """One station out of sight from one time to another."""

    station: str
    from_s: float
    to_s: float

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        if self.station not in seen.stations:
            raise UnknownName("station", self.station, seen.stations)
        lost = np.zeros(seen.quality.shape, bool)
        column = seen.stations.index(self.station)
        lost[:, column] = (seen.time_s[:, column] >= self.from_s) & (seen.time_s[:, column] < self.to_s)
        before = seen.marks.get("lost_station", np.zeros_like(lost))
        return replace(
            seen, quality=np.where(lost, 0.0, seen.quality), marks=seen.marked("lost_station", before | lost)
        )


@dataclass(frozen=True)
class Slip:
    """A strap that moves: rare steps of the mount, in the station's own axes, that stay. None by default."""

    per_minute: float = 0.0
    step_m: float = 0.005
    """Standard deviation of one step, per axis."""
    step_deg: float = 3.0

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        slips = per_station(seen, draw, lambda rng: self._slips(rng, seen))
        from_station = seen.tracker_from_station
        moved = seen.position_m + rotations.rotate(from_station, self.step_m * slips[..., :3])
        turned = rotations.multiply(from_station, rotations.exp(np.deg2rad(self.step_deg) * slips[..., 3:]))
        hit = np.any(slips != 0.0, axis=2)
        return replace(seen, position_m=moved, tracker_from_station=turned, marks=seen.marked("slip", hit))

    def _slips(self, rng: np.random.Generator, seen: Readings) -> Floats:
        """(E, 6) sums of unit steps up to each instant."""
        count = len(seen.time_s)
        steps = np.zeros((count, 6))
        happens = rng.random(count) < self.per_minute / (60.0 * seen.rate_hz)
        steps[happens] = rng.standard_normal((int(happens.sum()), 6))
        return np.cumsum(steps, axis=0)


def bursts(rng: np.random.Generator, count: int, share: float, shortest: int, longest: int) -> list[tuple[int, int]]:
    """Runs (start, stop) that cover `share` of the records in the long run; lengths even, gaps memoryless.

    Runs never touch. The first may have begun before the take, so that its start is like its middle.
    """
    if not share:
        return []
    mean = 0.5 * (shortest + longest)
    mean_gap = mean * (1.0 - share) / share
    at = -int(longest * 20 + mean_gap * 5)
    runs = []
    while at < count:
        at += int(rng.geometric(1.0 / mean_gap)) if mean_gap > 1.0 else 1
        stop = at + int(rng.integers(shortest, longest, endpoint=True))
        if stop > 0 and at < count:
            runs.append((max(at, 0), min(stop, count)))
        at = stop
    return runs


def _direction(rng: np.random.Generator) -> Floats:
    v = rng.standard_normal(3)
    out: Floats = v / np.sqrt(v @ v)
    return out
