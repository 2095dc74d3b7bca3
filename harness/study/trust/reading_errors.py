"""Errors of a tracker's readings on a known motion, and the health of its stream, for the device and for simulations.

An error is a reading minus what a tracker without errors would report at the nominal sampling time. Errors of the clock
are part of it: they displace a reading along the path. The median over a recording is subtracted, because mounts and
room are calibrated anew on each side.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.core.runs import find_runs
from harness.experiment.playback import Playback
from harness.experiment.score_recording import LoopFrames
from harness.results.trust_findings import StreamHealth
from harness.simulate.noise import Noise
from harness.simulate.simulation import TrackerConfig, sampling_times_s, simulate_readings
from harness.simulate.trajectory import Trajectory
from harness.stream.frame import TrackerFrame

FEATURES = {"position error": "m", "orientation error": "rad"}
"""Error -> its unit; each is a vector in the tracker's axes."""


@dataclass(frozen=True, eq=False)
class IdealReadings:
    """Readings of E instants of S stations without any error."""

    position_m: Floats
    """(E, S, 3)"""
    tracker_from_station: Floats
    """(E, S, 4) unit quaternions."""

    def __post_init__(self) -> None:
        freeze(self, position_m=("E", "S", 3))
        freeze(self, tracker_from_station=(*self.position_m.shape[:2], 4))


def ideal_readings(playback: Playback, tracker: TrackerConfig) -> IdealReadings:
    """Readings of the played take at the nominal sampling times of a tracker."""
    session = playback.clip_evaluation.session
    trajectory = Trajectory(playback.body, playback.take)
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(session.true_mounts))
    found = simulate_readings(
        trajectory, session.true_mounts, tracker, Noise(), time_s, seed=0, take=playback.take.name
    )
    return IdealReadings(found.position_m, found.turn)


def registered_readings(trajectory: Trajectory, calibration: Calibration, time_s: Floats) -> IdealReadings:
    """Readings of a take at times (E, S) [s] of a tracker whose room and mounts a registration found."""
    motion = trajectory.station_motion(calibration, time_s)
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    return IdealReadings(
        rotations.rotate(tracker_from_world, motion.position_m - calibration.tracker_origin_m),
        rotations.multiply(tracker_from_world, motion.world_from_station),
    )


def reading_errors(
    frames: Sequence[TrackerFrame], loops: Sequence[LoopFrames], ideal: IdealReadings
) -> dict[str, list[Floats]]:
    """`FEATURES` -> errors (N, S, 3) of each loop at its instants, one after another; NaN where there is no reading."""
    errors: dict[str, list[Floats]] = {name: [] for name in FEATURES}
    for loop in loops:
        first, last = int(loop.index[0]), int(loop.index[-1])
        read = [frames[row] for row in loop.rows]
        turn = rotations.multiply(
            np.array([frame.tracker_from_station for frame in read]),
            rotations.inverse(ideal.tracker_from_station[loop.index]),
        )
        found = {
            "position error": np.array([frame.position_m for frame in read]) - ideal.position_m[loop.index],
            "orientation error": rotations.log(turn),
        }
        usable = ~np.array([frame.suspect for frame in read])
        for name, values in found.items():
            series = np.full((last + 1 - first, *values.shape[1:]), np.nan)
            series[loop.index - first] = np.where(usable[:, :, None], values, np.nan)
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


def count_health(frames: Sequence[TrackerFrame], rows: Sequence[LoopFrames], rate_hz: float) -> list[HealthCounts]:
    """Counts of each station over the frames between the first and the last one of each loop.

    A frame that did not arrive at all counts as lost for every station, so that the device's silence is not overlooked.
    """
    stations = len(frames[0].measured_s)
    total = [HealthCounts() for _ in range(stations)]
    for loop in rows:
        read = [frames[row] for row in loop.rows]
        first, count = int(loop.index[0]), int(loop.index[-1]) + 1 - int(loop.index[0])
        received_s = read[-1].received_s - read[0].received_s
        duration_s = received_s * count / (count - 1) if count > 1 else 1.0 / rate_hz
        valid = np.zeros((count, stations), dtype=bool)
        valid[loop.index - first] = [frame.position_valid for frame in read]
        suspect = np.array([frame.suspect for frame in read]).sum(axis=0)
        quality = np.array([np.where(frame.position_valid, frame.quality, 0.0) for frame in read]).sum(axis=0)
        for k in range(stations):
            gaps = len(find_runs(~valid[:, k]))
            lost = int(count - valid[:, k].sum())
            counts = HealthCounts(count, lost, int(suspect[k]), gaps, duration_s, float(quality[k]))
            total[k] = total[k].add(counts)
    return total
