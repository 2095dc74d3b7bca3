"""Errors of a tracker's readings on a known motion, and the health of its stream, for the device and for simulations.

An error is a reading minus what a tracker without errors would report at the sampling time of the take. Errors of the
clock are part of it: they displace a reading along the path. The median over a recording is subtracted, because mounts
and room are calibrated anew on each side.
"""

from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, find_runs
from harness.experiment.observed_take import ObservedTake
from harness.results.trust_findings import StreamHealth
from harness.simulate.trajectory import Trajectory
from harness.stream.station_counts import StationCounts

FEATURES = {"position error": "m", "orientation error": "rad"}
"""Error -> its unit; each is a vector in the tracker's axes."""


def reading_errors(take: ObservedTake) -> dict[str, list[Floats]]:
    """`FEATURES` -> errors (N, S, 3) of each loop at its instants, one after another; NaN where there is no reading."""
    motion = Trajectory(take.clip.body, take.motion).station_motion(take.calibration, take.sample_s)
    tracker_from_world = rotations.inverse(take.calibration.world_from_tracker)
    position_m = rotations.rotate(tracker_from_world, motion.position_m - take.calibration.tracker_origin_m)
    tracker_from_station = rotations.multiply(tracker_from_world, motion.world_from_station)
    errors: dict[str, list[Floats]] = {name: [] for name in FEATURES}
    for loop in take.loops:
        read = [take.frames[row] for row in loop.rows]
        turn = rotations.multiply(
            np.array([frame.tracker_from_station for frame in read]),
            rotations.inverse(tracker_from_station[loop.index]),
        )
        found = {
            "position error": np.array([frame.position_m for frame in read]) - position_m[loop.index],
            "orientation error": rotations.log(turn),
        }
        usable = ~np.array([frame.suspect for frame in read])
        for name, values in found.items():
            series = np.full((len(loop.expected), *values.shape[1:]), np.nan)
            series[loop.index - loop.expected.start] = np.where(usable[:, :, None], values, np.nan)
            errors[name].append(_without_median(series))
    return errors


def _without_median(series: Floats) -> Floats:
    """A series (N, S, 3) minus its median; a station without any reading stays NaN."""
    some = np.isfinite(series).any(axis=0)
    middle = np.full(series.shape[1:], np.nan)
    middle[some] = np.nanmedian(series[:, some], axis=0)
    out: Floats = series - middle
    return out


@dataclass
class HealthCounts:
    """Counts of one station's stream that add up over recordings."""

    frames: int = 0
    lost: int = 0
    suspect: int = 0
    gaps: int = 0
    duration_s: float = 0.0
    quality: float = 0.0
    """Sum over the frames with a usable position."""

    def add(self, other: "HealthCounts") -> "HealthCounts":
        """The counts of both."""
        return HealthCounts(*(mine + its for mine, its in zip(vars(self).values(), vars(other).values(), strict=True)))

    def as_health(self) -> StreamHealth:
        """Rates and shares; a stream without frames is lost for all of its time."""
        seen, minutes = self.frames - self.lost, self.duration_s / 60.0
        rate_hz = self.frames / self.duration_s if self.duration_s else 0.0
        return StreamHealth(
            rate_hz,
            self.lost / self.frames if self.frames else 1.0,
            self.gaps / minutes if minutes else 0.0,
            self.lost / rate_hz / self.gaps if self.gaps and rate_hz else None,
            self.quality / seen if seen else 0.0,
            self.suspect / self.frames if self.frames else 0.0,
        )


def count_health(take: ObservedTake) -> list[HealthCounts]:
    """Counts of each station over the frames between the first and the last one of each loop.

    A frame that did not arrive at all counts as lost for every station, so that the device's silence is not overlooked.
    """
    stations = len(take.calibration.stations)
    total = [HealthCounts() for _ in range(stations)]
    for loop in take.loops:
        read, count = [take.frames[row] for row in loop.rows], len(loop.expected)
        received_s = read[-1].received_s - read[0].received_s
        duration_s = received_s * count / (count - 1) if count > 1 else 1.0 / take.rate_hz
        valid = np.zeros((count, stations), dtype=bool)
        valid[loop.index - loop.expected.start] = [frame.position_valid for frame in read]
        counts = StationCounts(stations)
        for frame in read:
            counts.add(frame)
        quality = counts.quality.tolist()
        for k in range(stations):
            gaps, lost = len(find_runs(~valid[:, k])), count - int(counts.positions[k])
            total[k] = total[k].add(HealthCounts(count, lost, int(counts.suspect[k]), gaps, duration_s, quality[k]))
    return total
