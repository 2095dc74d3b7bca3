"""Median station poses over a hold (a few seconds in which the performer stands still), and the checks of a hold.

Positions are medians. Orientations are geometric medians of rotations (Hartley, Aftab, Trumpf 2011, "L1 rotation
averaging using the Weiszfeld algorithm"). Up to half of the readings may be outliers or missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, freeze
from harness.errors import BadInput
from harness.stream import TrackerFrame

LEAST_S, LEAST_FRAMES = 2.0, 10
"""Shortest hold: device errors have a correlation time of 1 s (docs/is900.md 13.5) and must average out."""
LEAST_SHARE = 0.5
"""Least share of usable readings: a median breaks down when more than half are missing or suspect."""
SWAY_M, SWAY_RAD = 0.03, float(np.deg2rad(5.0))
"""Allowed sway [m, rad]: the device itself is off by up to 3 cm for seconds (docs/is900.md 13.1, GIL), and people with
arms held out sway as much; 5 deg is 3 cm at a third of a metre [choice]."""
NOISE_SDS = 5.0
"""Allowance for noise on top of the sway, in standard deviations of a single reading in this stream [choice]."""
_ROUNDS, _CONVERGED_RAD = 30, 1e-7


class UnusableHold(BadInput):
    """A hold that cannot be calibrated from; the message says what to do before the next try."""


@dataclass(frozen=True, eq=False)
class HoldReadings:
    """Median readings of S stations over a hold."""

    seconds: float
    """Length of the hold [s]."""
    position_m: Floats
    """(S, 3) median position in the tracker's frame [m]."""
    tracker_from_station: Floats
    """(S, 4) median orientation, unit quaternions."""
    moved_m: Floats
    """(S,) three quarters of the readings lie within this distance of the median [m]."""
    turned_rad: Floats
    """(S,) three quarters of the readings lie within this angle of the median [rad]."""

    def __post_init__(self) -> None:
        freeze(self, position_m=("S", 3), tracker_from_station=("S", 4), moved_m=("S",), turned_rad=("S",))


def measure_hold(frames: Sequence[TrackerFrame], stations: Sequence[str], pose: str = "T-pose") -> HoldReadings:
    """Median readings of the stations over some frames; `pose` is the pose's name in messages.

    UnusableHold when there are too few frames or readings, or a station moved. BadInput for other stations.
    """
    seconds = span_s(frames)
    if seconds < LEAST_S or len(frames) < LEAST_FRAMES:
        raise UnusableHold(
            f"{len(frames)} frames in {seconds:.1f} s are too few to calibrate from.",
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
    """Time from the first frame to the last, by the host's clock [s]; 0 without frames."""
    return frames[-1].received_s - frames[0].received_s if frames else 0.0


def median_rotation(turn: Floats) -> Floats:
    """Geometric median (4,) of unit quaternions (N, 4): the rotation with the least sum of angles to them."""
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
    """Median position and orientation of one station's readings (N, 3), (N, 4), their spread, and its limits."""
    at_m, middle = np.median(position_m, axis=0), median_rotation(turn)
    off = rotations.log(rotations.multiply(rotations.inverse(middle), turn))
    moved_m, turned_rad = (float(np.quantile(np.linalg.norm(x, axis=1), 0.75)) for x in (position_m - at_m, off))
    limit_m, limit_rad = SWAY_M + NOISE_SDS * _noise_sd(position_m), SWAY_RAD + NOISE_SDS * _noise_sd(off)
    return at_m, middle, moved_m, turned_rad, limit_m, limit_rad


def _noise_sd(readings: Floats) -> float:
    """Standard deviation of a single reading (N, 3) on an axis.

    Second differences cancel steady motion; their median absolute value is robust against echoes.
    """
    second = np.diff(readings, n=2, axis=0)
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6.0))


def _usable(frames: Sequence[TrackerFrame], position_m: Floats, turn: Floats) -> Bools:
    """(F, S) whether a reading is complete, finite and not suspect."""
    valid = np.array([frame.position_valid & frame.orientation_valid & ~frame.suspect for frame in frames])
    out: Bools = valid & np.isfinite(position_m).all(axis=2) & np.isfinite(turn).all(axis=2)
    return out


def _require_readings(frames: Sequence[TrackerFrame], share: Floats, stations: Sequence[str], pose: str) -> None:
    """UnusableHold when too small a share (S,) of a station's readings is usable."""
    if share.min() >= LEAST_SHARE:
        return
    worst = int(np.argmin(share))
    placed, turned, suspect = (
        np.mean([getattr(frame, field)[worst] for frame in frames])
        for field in ("position_valid", "orientation_valid", "suspect")
    )
    why, advice = "was silent or lost", "Switch it on, and stand where the emitters see it."
    if placed >= LEAST_SHARE and turned < LEAST_SHARE:
        why, advice = "reported no orientation", "Ask the device for orientation (item 4 or 11) in its output list."
    elif turned >= LEAST_SHARE and placed < LEAST_SHARE:
        why = "reported no position"
    elif suspect > 1.0 - LEAST_SHARE:
        why, advice = "sent suspect records", "Check the line, the output lists and which stations are on."
    raise UnusableHold(
        f"Station {stations[worst]!r} {why}: {share[worst]:.0%} of its readings are usable, not {LEAST_SHARE:.0%}.",
        f"{advice} Then hold the pose again ({pose}).",
    )


def _require_stillness(
    stations: Sequence[str], moved_m: Floats, limit_m: Floats, turned_rad: Floats, limit_rad: Floats, pose: str
) -> None:
    """UnusableHold when a station moved farther than its limit."""
    worst = int(np.argmax(np.maximum(moved_m / limit_m, turned_rad / limit_rad)))
    if moved_m[worst] <= limit_m[worst] and turned_rad[worst] <= limit_rad[worst]:
        return
    raise UnusableHold(
        f"Station {stations[worst]!r} moved by {1e3 * moved_m[worst]:.0f} mm and "
        f"{np.rad2deg(turned_rad[worst]):.0f} deg; sway and noise explain {1e3 * limit_m[worst]:.0f} mm and "
        f"{np.rad2deg(limit_rad[worst]):.0f} deg.",
        f"Stand still in the pose ({pose}), and check that the strap is tight.",
    )
