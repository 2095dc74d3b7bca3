"""Which of two pose logs hold `body_from_world` instead of `world_from_body`, where no file says so.

Orientations agree if both logs, or none, are inverted. The other case shows in their residuals. Which of two equal
cases holds shows in the mounts: two frames on one rigid body are near each other, and two worlds need not be.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.measure.angular_speed import coarse_offset
from harness.measure.handeye import PosePairs, pair_residuals, solve_trimmed
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline

FAR_MOUNT_M = 0.5
"""Distance of two frames on one body from which on the inverse poses are considered [m] [choice]."""
_MOST_PAIRS = 5000
"""About the most pairs of a station that directions are told by."""
CLEAR_FACTOR = 3.0
"""Factor by which inverse poses must leave less, or give a shorter mount, to be believed [choice]."""


@dataclass(frozen=True)
class PoseDirections:
    """What is inverted before two logs are registered, and why."""

    capture: bool
    truth: bool
    reason: str
    """The evidence, a sentence; "" where nothing is inverted."""


@dataclass(frozen=True)
class _Candidate:
    capture: bool
    truth: bool
    turn_rad: float
    """Median error of orientations [rad]."""
    mount_m: float
    """Longest mount [m]."""


def invert_poses(position_m: Floats, quaternions: Floats) -> tuple[Floats, Floats]:
    """The inverse poses (N, 3), (N, 4)."""
    inverse = rotations.inverse(quaternions)
    return -rotations.rotate(inverse, position_m), inverse


def inverted_poses(station: MeasuredPoses) -> MeasuredPoses:
    """A station whose poses are the inverse ones."""
    place, turn = invert_poses(station.position_m, station.tracker_from_station)
    return MeasuredPoses(station.measured_s, place, turn, station.valid)


def inverted_truth(truth: TruthPoses) -> TruthPoses:
    """A reference whose poses are the inverse ones."""
    return TruthPoses(truth.time_s, *invert_poses(truth.position_m, truth.world_from_body))


def same_directions(
    stations: Mapping[str, MeasuredPoses], truths: Mapping[str, TruthPoses], pairs: Mapping[str, str]
) -> tuple[dict[str, MeasuredPoses], dict[str, TruthPoses], tuple[str, ...]]:
    """Stations and bodies of two logs, inverted where one or both hold body-from-world poses, and why.

    NotComparable as `find_directions`.
    """
    found = find_directions(stations, truths, pairs)
    return (
        {name: inverted_poses(one) if found.capture else one for name, one in stations.items()},
        {name: inverted_truth(one) if found.truth else one for name, one in truths.items()},
        (found.reason,) if found.reason else (),
    )


def find_directions(
    stations: Mapping[str, MeasuredPoses],
    truths: Mapping[str, TruthPoses],
    pairs: Mapping[str, str],
) -> PoseDirections:
    """Which of both logs must be inverted so that they are of the same rigid bodies; nothing is, where none is clear.

    NotComparable for motion about one axis and for little overlap.
    """
    named = {station: stations[station] for station in pairs}
    splines = {station: TruthSpline(truths[body]) for station, body in pairs.items()}
    offset_s = coarse_offset(named, splines).offset_s
    found = [
        _candidate(named, truths, pairs, offset_s, capture, truth)
        for capture in (False, True)
        for truth in (False, True)
    ]
    alike, unlike = ([one for one in found if (one.capture != one.truth) is other] for other in (False, True))
    if CLEAR_FACTOR * unlike[0].turn_rad < alike[0].turn_rad:
        best = min(unlike, key=lambda one: one.mount_m)
        which = "the capture" if best.capture else "the reference"
        angles = f"{np.rad2deg(best.turn_rad):.2g} instead of {np.rad2deg(alike[0].turn_rad):.2g} deg"
        return PoseDirections(
            best.capture, best.truth, f"Poses of {which} are body-from-world and were inverted: errors are {angles}."
        )
    plain, both = alike
    if plain.mount_m > FAR_MOUNT_M and CLEAR_FACTOR * both.mount_m < plain.mount_m:
        lengths = f"{both.mount_m:.2f} instead of {plain.mount_m:.2f} m"
        return PoseDirections(True, True, f"Poses of both are body-from-world and were inverted: mounts are {lengths}.")
    return PoseDirections(False, False, "")


def _candidate(
    stations: Mapping[str, MeasuredPoses],
    truths: Mapping[str, TruthPoses],
    pairs: Mapping[str, str],
    offset_s: float,
    capture: bool,
    truth: bool,
) -> _Candidate:
    paired = []
    for name, body in pairs.items():
        station = inverted_poses(stations[name]) if capture else stations[name]
        spline = TruthSpline(inverted_truth(truths[body]) if truth else truths[body])
        paired.append(_pair_at(station, spline, offset_s))
    state = solve_trimmed(paired)
    turns = [np.linalg.norm(pair_residuals(one, state, s)[1], axis=1) for s, one in enumerate(paired)]
    longest_m = float(np.linalg.norm(state.mount_m, axis=1).max())
    return _Candidate(capture, truth, float(np.median(np.concatenate(turns))), longest_m)


def _pair_at(station: MeasuredPoses, spline: TruthSpline, offset_s: float) -> PosePairs:
    """Evenly spread records with a reference at an offset of the clocks [s], and the reference's poses there."""
    rows = np.flatnonzero(station.valid & np.isfinite(station.measured_s))
    rows = rows[spline.covers(station.measured_s[rows] - offset_s)]
    rows = rows[:: len(rows) // _MOST_PAIRS + 1]
    body_m, body = spline.poses(station.measured_s[rows] - offset_s)
    return PosePairs(station.position_m[rows], station.tracker_from_station[rows], body_m, body)
