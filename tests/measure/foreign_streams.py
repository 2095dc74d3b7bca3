"""Pairs of streams as other devices write them: uneven, with gaps, drift, signs that flip, and conventions unsaid."""

from dataclasses import dataclass, field, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.measure.pose_directions import invert_poses
from harness.measure.pose_series import MeasuredPoses, TruthPoses
from tests.measure.moving_bodies import Tracker, move_bodies, report_poses

MOUNT_M = np.array([0.08, -0.05, 0.03])
MOUNT = rotations.exp(np.array([0.4, -1.1, 2.0]))


@dataclass(frozen=True)
class Source:
    """How a foreign device reports."""

    tracker: Tracker = field(
        default_factory=lambda: Tracker(
            scale=-0.06, offset_s=3.7, white=(0.002, 0.004), drift=(0.006, 0.01), correlation_s=1.5, rate_hz=370.0
        )
    )
    seconds: float = 60.0
    steps: tuple[int, int] = (4, 18)
    """Least and most of the 370 places a second from one pose to the next: steps are uneven."""
    gap_s: tuple[tuple[float, float], ...] = ((12.0, 14.5), (40.0, 41.0))
    """Stretches without a pose, on the source's clock from its first pose [s]."""
    resolution_s: float = 0.01
    """Times are printed to this."""
    turns: tuple[float, float, float] = (0.6, 0.5, 0.4)
    capture_inverted: bool = False
    truth_inverted: bool = False
    truth_noise: tuple[float, float] = (0.0, 0.0)


def foreign_pair(rng: np.random.Generator, source: Source) -> tuple[MeasuredPoses, TruthPoses]:
    """The poses of the source, and of its reference at 100 poses a second, uneven too."""
    truth = move_bodies(rng, ("body",), source.seconds, source.turns)
    station = report_poses(rng, truth, {"body": (MOUNT_M, MOUNT)}, source.tracker)["body"]
    since_s = station.measured_s - station.measured_s[0]
    rows = np.zeros(len(since_s), bool)
    places = np.cumsum(rng.integers(source.steps[0], source.steps[1] + 1, len(since_s)))
    rows[places[places < len(since_s)]] = True
    for begin_s, end_s in source.gap_s:
        rows &= (since_s < begin_s) | (since_s > end_s)
    time_s = np.round(station.measured_s[rows] / source.resolution_s) * source.resolution_s
    time_s, first = np.unique(time_s, return_index=True)
    place, turn = station.position_m[rows][first], station.tracker_from_station[rows][first]
    turn = turn * rng.choice([-1.0, 1.0], len(turn))[:, None]
    capture = MeasuredPoses(time_s, place, turn, np.ones(len(time_s), bool))
    return inverted_capture(capture) if source.capture_inverted else capture, _reference(rng, truth["body"], source)


def inverted_capture(capture: MeasuredPoses) -> MeasuredPoses:
    place, turn = invert_poses(capture.position_m, capture.tracker_from_station)
    return replace(capture, position_m=place, tracker_from_station=turn)


def _reference(rng: np.random.Generator, truth: TruthPoses, source: Source) -> TruthPoses:
    rows = rng.random(len(truth.time_s)) < 0.8
    place, turn = truth.position_m[rows], truth.world_from_body[rows]
    place = place + source.truth_noise[0] * rng.normal(size=place.shape)
    turn = rotations.multiply(turn, rotations.exp(source.truth_noise[1] * rng.normal(size=place.shape)))
    if source.truth_inverted:
        place, turn = invert_poses(place, turn)
    return TruthPoses(truth.time_s[rows], place, rotations.continuous(turn))


def resting_times(rng: np.random.Generator, seconds: float, low_s: float = 0.01, high_s: float = 0.0233) -> Floats:
    """Times with uneven steps [s]."""
    steps = rng.uniform(low_s, high_s, round(2.0 * seconds / (low_s + high_s)))
    out: Floats = np.cumsum(steps) - steps[0]
    return out
