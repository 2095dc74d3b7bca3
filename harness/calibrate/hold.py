"""What each station read of a performer who stood still, past echoes and gaps, and whether the performer did so.

Positions are medians, orientations rotation medians (Hartley, Aftab, Trumpf 2011, "L1 rotation averaging using the
Weiszfeld algorithm"): up to half of the readings may be anywhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, freeze
from harness.errors import BadInput
from harness.stream.frame import TrackerFrame

LEAST_S, LEAST_FRAMES = 2.0, 10
"""Errors that wander with a correlation time of 1 s (docs/is900.md 13.5) need this long to average out at all."""
LEAST_SHARE = 0.5
"""A median says nothing when more than half of the readings are missing or in doubt."""
SWAY_M, SWAY_RAD = 0.03, float(np.deg2rad(5.0))
"""The device itself is off by up to 3 cm for seconds (docs/is900.md 13.1, GIL), and nobody stands stiller than that
with arms held out; 5 deg is 3 cm at a third of a metre [choice]."""
NOISE_SDS = 5.0
"""On top of it, so many standard deviations of a single reading, as this very stream shows them [choice]."""
_ROUNDS, _CONVERGED_RAD = 30, 1e-7


class UnusableHold(BadInput):
    """A few seconds that cannot be calibrated from; the performer can try again."""


@dataclass(frozen=True, eq=False)
class HoldReadings:
    """Typical readings of S stations over some seconds."""

    seconds: float
    position_m: Floats
    """(S, 3) in the tracker's frame [m]."""
    tracker_from_station: Floats
    """(S, 4)"""
    moved_m: Floats
    """(S,) three quarters of the readings lie within this distance of the typical one [m]."""
    turned_rad: Floats
    """(S,) likewise [rad]."""

    def __post_init__(self) -> None:
        freeze(self, position_m=("S", 3), tracker_from_station=("S", 4), moved_m=("S",), turned_rad=("S",))


def measure_hold(frames: Sequence[TrackerFrame], stations: Sequence[str], pose: str = "T-pose") -> HoldReadings:
    """Typical readings; NotStanding when they are too few or somebody moved, BadInput for other stations.

    `pose` is what the performer is asked to hold.
    """
    seconds = span_s(frames)
    if seconds < LEAST_S or len(frames) < LEAST_FRAMES:
        raise UnusableHold(
            f"{len(frames)} frames within {seconds:.1f} s are too few to calibrate from.",
            f"Hold the pose ({pose}) for {LEAST_S:g} s or more while the tracker streams.",
        )
    if any(len(frame.quality) != len(stations) for frame in frames):
        raise BadInput(
            f"Frames of {len(frames[0].quality)} stations, but {len(stations)} are worn: {', '.join(stations)}.",
            "Name the stations of the stream, in its order.",
        )
    position_m = np.array([frame.position_m for frame in frames])
    turn = np.array([frame.tracker_from_station for frame in frames])
    usable = _usable(frames, position_m, turn)
    _require_readings(frames, usable.mean(axis=0), stations, pose)
    rows = [_typical_reading(position_m[usable[:, s], s], turn[usable[:, s], s]) for s in range(len(stations))]
    at_m, turned, moved_m, turned_rad, limit_m, limit_rad = (np.array(column) for column in zip(*rows, strict=True))
    _require_stillness(stations, moved_m, limit_m, turned_rad, limit_rad, pose)
    return HoldReadings(seconds, at_m, turned, moved_m, turned_rad)


def span_s(frames: Sequence[TrackerFrame]) -> float:
    """From the first frame to the last, by the host's clock [s]."""
    return frames[-1].received_s - frames[0].received_s if frames else 0.0


def median_rotation(turn: Floats) -> Floats:
    """The unit quaternion (4,) whose angles to the given ones (N, 4) have the least sum."""
    middle: Floats = turn[np.argmax(np.abs(turn @ turn.T).sum(axis=1))]
    for _ in range(_ROUNDS):
        off = rotations.log(rotations.multiply(rotations.inverse(middle), turn))
        weight = 1.0 / np.maximum(np.linalg.norm(off, axis=1), 1e-6)
        step = weight @ off / weight.sum()
        middle = rotations.multiply(middle, rotations.exp(step))
        if np.abs(step).max() < _CONVERGED_RAD:
            break
    return middle / np.linalg.norm(middle)


def _typical_reading(position_m: Floats, turn: Floats) -> tuple[Floats, Floats, float, float, float, float]:
    """Typical position and orientation of one station's readings (N, 3), (N, 4), how far it strayed, how far it may."""
    at_m, middle = np.median(position_m, axis=0), median_rotation(turn)
    off = rotations.log(rotations.multiply(rotations.inverse(middle), turn))
    moved_m, turned_rad = (float(np.quantile(np.linalg.norm(x, axis=1), 0.75)) for x in (position_m - at_m, off))
    limit_m, limit_rad = SWAY_M + NOISE_SDS * _noise_sd(position_m), SWAY_RAD + NOISE_SDS * _noise_sd(off)
    return at_m, middle, moved_m, turned_rad, limit_m, limit_rad


def _noise_sd(readings: Floats) -> float:
    """Standard deviation of a single reading (N, 3) on an axis: from second differences, in which steady motion
    cancels, by their median, which echoes leave alone."""
    second = np.diff(readings, n=2, axis=0)
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6.0))


def _usable(frames: Sequence[TrackerFrame], position_m: Floats, turn: Floats) -> Bools:
    """(F, S)"""
    told = np.array([frame.position_valid & frame.orientation_valid & ~frame.suspect for frame in frames])
    out: Bools = told & np.isfinite(position_m).all(axis=2) & np.isfinite(turn).all(axis=2)
    return out


def _require_readings(frames: Sequence[TrackerFrame], share: Floats, stations: Sequence[str], pose: str) -> None:
    """NotStanding when too small a share (S,) of a station's readings is of use."""
    if share.min() >= LEAST_SHARE:
        return
    worst = int(np.argmin(share))
    placed, turned, suspect = (
        np.mean([getattr(frame, field)[worst] for frame in frames])
        for field in ("position_valid", "orientation_valid", "suspect")
    )
    why, advice = "was silent or lost", "Switch it on, and stand where the emitters see it."
    if placed >= LEAST_SHARE and turned < LEAST_SHARE:
        why, advice = "told no orientation", "Ask the device for orientation (item 4 or 11) in its output list."
    elif turned >= LEAST_SHARE and placed < LEAST_SHARE:
        why = "told no position"
    elif suspect > 1.0 - LEAST_SHARE:
        why, advice = "sent records in doubt", "Check the line, the output lists and which stations are on."
    raise UnusableHold(
        f"Station {stations[worst]!r} {why}: {share[worst]:.0%} of its readings are of use; {LEAST_SHARE:.0%} must be.",
        f"{advice} Then hold the pose again ({pose}).",
    )


def _require_stillness(
    stations: Sequence[str], moved_m: Floats, limit_m: Floats, turned_rad: Floats, limit_rad: Floats, pose: str
) -> None:
    worst = int(np.argmax(np.maximum(moved_m / limit_m, turned_rad / limit_rad)))
    if moved_m[worst] <= limit_m[worst] and turned_rad[worst] <= limit_rad[worst]:
        return
    raise UnusableHold(
        f"Station {stations[worst]!r} moved: it strayed by {1e3 * moved_m[worst]:.0f} mm and "
        f"{np.rad2deg(turned_rad[worst]):.0f} deg, where {1e3 * limit_m[worst]:.0f} mm and "
        f"{np.rad2deg(limit_rad[worst]):.0f} deg are sway and noise.",
        f"Stand still in the pose ({pose}), and see that the strap is tight.",
    )
