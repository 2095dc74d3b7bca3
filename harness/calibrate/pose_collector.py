"""Finds the poses that a performer holds, one after another, in a stream: live or from a recording.

A hold is `HOLD_S` in which every station is still (by the rules of `still`), without its beginning and end; readings
that stray from it are marked as suspect. The next one counts when a station has been somewhere else in between and is
there now; and, where it is known what the poses look like, when it looks like the pose that is wanted: a rest, a
repeated pose or one that was left out never shifts the order.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.calibrate.hold import SWAY_M, HoldReadings, UnusableHold, measure_hold, span_s
from harness.calibrate.pose_classifier import PoseClassifier
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.stream.frame import TrackerFrame

HOLD_S, EDGE_S = 2.7, 0.25
"""A hold, and what is left out of it at either end [s]; what remains is `still.LEAST_S` and two periods of 10 Hz."""
STEADY_SHARE = 0.65
"""So much of it each station is where it is on the whole. What it reads elsewhere is left out: the device is off for a
while now and then (docs/is900.md 13.1), at one station at a time, and a performer moves more of them [choice]."""
CHECK_EVERY_S = 0.2
"""So often it is looked whether somebody holds still [choice]."""
GAP_S = 0.5
"""After so long without a frame, nobody knows what the performer did [choice]."""
MOVED_M, MOVED_RAD = 0.10, float(np.deg2rad(20.0))
"""A station that is this far from where it was in the last hold has moved: three times what is still [choice]."""


@dataclass(frozen=True)
class RejectedHold:
    """A hold that was not taken."""

    began_s: float
    """Since the first frame [s]."""
    why: str

    def __str__(self) -> str:
        return f"not taken what was held from {self.began_s:.1f} s on: {self.why}"


class PoseCollector:
    """Takes the holds of so many poses, in their order; `likeness` knows what they look like."""

    def __init__(self, stations: Sequence[str], poses: int = 8, likeness: PoseClassifier | None = None) -> None:
        self.stations, self.poses = tuple(stations), poses
        self.holds: list[list[TrackerFrame]] = []
        """Frames of each pose taken, without the edges."""
        self.began_s: list[float] = []
        """When each of them began, since the first frame [s]."""
        self.rejected: list[RejectedHold] = []
        """Holds that were not taken, and why."""
        self.message = ""
        """What is going on, for the performer."""
        self._likeness = likeness
        self._window: deque[TrackerFrame] = deque()
        self._began_s: float | None = None
        self._looked_s = -np.inf
        self._first: HoldReadings | None = None
        self._last: _HoldStatistics | None = None

    @property
    def done(self) -> bool:
        return len(self.holds) >= self.poses

    def add(self, frame: TrackerFrame) -> int | None:
        """How many poses are complete, when one just was."""
        now_s, window = frame.received_s, self._window
        self._began_s = now_s if self._began_s is None else self._began_s
        if window and now_s - window[-1].received_s > GAP_S:
            window.clear()
        window.append(frame)
        while len(window) > 2 and now_s - window[1].received_s >= HOLD_S:
            window.popleft()
        if now_s - self._looked_s < CHECK_EVERY_S or span_s(window) < HOLD_S:
            return None
        self._looked_s = now_s
        return self._look(list(window))

    def _look(self, frames: list[TrackerFrame]) -> int | None:
        stance, time_s = _hold_statistics(frames), np.array([frame.received_s for frame in frames])
        if (moving := self._moving(stance.strays, time_s)) is not None:
            self.message = f"hold still: station {moving!r} moves"
            return None
        if self._last is not None and not stance.elsewhere(self._last):
            self._last = stance  # whoever drifts while standing has not moved
            return None
        inner = np.flatnonzero((time_s >= time_s[0] + EDGE_S) & (time_s <= time_s[-1] - EDGE_S)).tolist()
        kept = [replace(frames[row], suspect=frames[row].suspect | stance.strays[row]) for row in inner]
        try:
            still = measure_hold(kept, self.stations)
        except UnusableHold as error:
            self.message = f"hold still: {error.what}"
            return None
        self._last = stance
        return self._held(kept, still)

    def _moving(self, strays: Bools, time_s: Floats) -> str | None:
        """A station that strays too long, or the second that is elsewhere as the hold begins or as it ends."""
        for when, least, share in (
            (time_s > -np.inf, 1, 1.0 - STEADY_SHARE),
            (time_s <= time_s[0] + 2.0 * EDGE_S, 2, 0.5),
            (time_s >= time_s[-1] - 2.0 * EDGE_S, 2, 0.5),
        ):
            strayed = strays[when].mean(axis=0)
            if np.sum(strayed > share) >= least:
                return self.stations[int(np.argmax(strayed))]
        return None

    def _held(self, frames: list[TrackerFrame], still: HoldReadings) -> int | None:
        """A hold that is none of those before."""
        began_s = frames[0].received_s - (self._began_s or 0.0)
        wanted = len(self.holds)
        if self.done:
            why = f"all {self.poses} poses were taken before"
        elif self._likeness is None or self._likeness.matches(wanted, still, self._first):
            self._first = self._first or still
            self.holds.append(frames)
            self.began_s.append(began_s)
            self.message = f"pose {wanted + 1} of {self.poses} taken"
            return wanted + 1
        else:
            nearest = self._likeness.nearest(still, self._first)
            looks = "none of the poses" if nearest is None else f"pose {nearest + 1}"
            why = f"that looks like {looks}, and pose {wanted + 1} is wanted"
        self.rejected.append(RejectedHold(began_s, why))
        self.message = str(self.rejected[-1])
        return None


@dataclass(frozen=True, eq=False)
class _HoldStatistics:
    """Where stations are in some frames, told fast; NaN for one that is never seen."""

    middle_m: Floats
    """(S, 3)"""
    turn: Floats
    """(S, 4)"""
    strays: Bools
    """(F, S) whether a station is seen farther from there than sway and its noise take it."""

    def elsewhere(self, before: "_HoldStatistics") -> bool:
        moved_m = np.linalg.norm(self.middle_m - before.middle_m, axis=1)
        turned_rad = rotations.angle_between_rad(self.turn, before.turn)
        return bool(np.any(moved_m > MOVED_M) or np.any(turned_rad > MOVED_RAD))


def _hold_statistics(frames: Sequence[TrackerFrame]) -> _HoldStatistics:
    sound = np.array([frame.position_valid & frame.orientation_valid & ~frame.suspect for frame in frames])[..., None]
    seen_m = np.where(sound, np.array([frame.position_m for frame in frames]), np.nan)
    middle_m = _nan_median(seen_m)
    off_m = np.linalg.norm(seen_m - middle_m, axis=2)
    turn = np.where(sound, np.array([frame.tracker_from_station for frame in frames]), np.nan)
    largest = np.argmax(np.nan_to_num(np.abs(turn)).sum(axis=0), axis=1)  # the sign of a quaternion is anybody's
    turn = turn * np.where(np.take_along_axis(turn, largest[None, :, None], axis=2) < 0.0, -1.0, 1.0)
    middle = _nan_median(turn)
    turned = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    return _HoldStatistics(middle_m, turned, off_m > SWAY_M + _nan_median(off_m))


def _nan_median(values: Floats) -> Floats:
    """Over the first axis, of what is not NaN; NaN where all is."""
    middle = np.maximum(np.isfinite(values).sum(axis=0) - 1, 0) // 2
    out: Floats = np.take_along_axis(np.sort(values, axis=0), middle[None], axis=0)[0]
    return out
