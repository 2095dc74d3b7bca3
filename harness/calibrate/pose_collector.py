"""Finds the poses that a performer holds, one after another, in a stream: live or from a recording.

A hold is a stretch of `HOLD_S` seconds in which every station is still (by the rules of `hold`). Its beginning and
end are cut off, and readings outside the sway limit are marked as suspect. The next hold counts only if a station has
moved since the last one. With a `PoseClassifier` the hold must also look like the pose that is wanted, so a rest, a
repeated pose or a skipped pose never shifts the order. A pose in which up to half of the stations are silent is left
out if the others say that it is held: the emitters may not reach a station in it.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.calibrate.hold import LEAST_SHARE, SWAY_M, HoldReadings, UnusableHold, measure_hold, span_s
from harness.calibrate.pose_classifier import PoseClassifier
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.stream import TrackerFrame

HOLD_S, EDGE_S = 2.7, 0.25
"""Length of a hold, and what is cut off at either end [s]. The rest is `hold.LEAST_S` plus two periods of 10 Hz."""
STEADY_SHARE = 0.65
"""Least share of a hold in which a station is within its sway limit; readings outside it are left out. The device
itself is off at times, at one station at a time (docs/is900.md 13.1); a performer moves several stations [choice]."""
CHECK_EVERY_S = 0.2
"""Time between two checks for a hold [s] [choice]."""
MOST_LEFT_OUT = 3
"""Most poses that may be left out [choice]."""
GAP_S = 0.5
"""A gap between frames longer than this starts the search for a hold anew [s] [choice]."""
MOVED_M, MOVED_RAD = 0.10, float(np.deg2rad(20.0))
"""A station farther than this from its place in the last hold has moved: three times the sway limit [choice]."""


@dataclass(frozen=True)
class RejectedHold:
    """A hold that was not taken, and the reason."""

    began_s: float
    """Beginning of the hold, since the first frame [s]."""
    why: str

    def __str__(self) -> str:
        return f"hold from {self.began_s:.1f} s on not taken: {self.why}"


class PoseCollector:
    """Collects the holds of a number of poses, in order; an optional `classifier` checks which pose is held."""

    def __init__(self, stations: Sequence[str], poses: int = 8, classifier: PoseClassifier | None = None) -> None:
        self.stations, self.poses = tuple(stations), poses
        self.holds: list[list[TrackerFrame]] = []
        """Frames of each pose, without the edges; none of a pose that is left out."""
        self.began_s: list[float] = []
        """Beginning of each hold, since the first frame [s]."""
        self.rejected: list[RejectedHold] = []
        """Holds that were not taken, and why."""
        self.message = ""
        """The current state in one sentence, for the performer."""
        self._classifier = classifier
        self._window: deque[TrackerFrame] = deque()
        self._began_s: float | None = None
        self._checked_s = -np.inf
        self._first: HoldReadings | None = None
        self._last: _HoldStatistics | None = None

    @property
    def done(self) -> bool:
        return len(self.holds) >= self.poses

    def add(self, frame: TrackerFrame) -> int | None:
        """Take up a frame; returns the number of poses that are done if this frame completed one, else None."""
        now_s, window = frame.received_s, self._window
        self._began_s = now_s if self._began_s is None else self._began_s
        if window and now_s - window[-1].received_s > GAP_S:
            window.clear()
        window.append(frame)
        while len(window) > 2 and now_s - window[1].received_s >= HOLD_S:
            window.popleft()
        if now_s - self._checked_s < CHECK_EVERY_S or span_s(window) < HOLD_S:
            return None
        self._checked_s = now_s
        return self._check(list(window))

    def still_s(self) -> float:
        """Longest time up to now in which no station moves by the rules of a hold [s], at most `HOLD_S`.

        In steps of `CHECK_EVERY_S`. 0 while the performer has not moved since the last hold, and while a station is
        silent. It is computed anew at each call, from up to `HOLD_S` of frames.
        """
        frames, still_s = list(self._window), 0.0
        time_s = np.array([frame.received_s for frame in frames])
        for wanted_s in np.arange(2.0 * EDGE_S, span_s(frames) + CHECK_EVERY_S, CHECK_EVERY_S).tolist():
            first = int(np.searchsorted(time_s, time_s[-1] - wanted_s))
            statistics = _hold_statistics(frames[first:])
            if not np.isfinite(statistics.middle_m).all() or not np.isfinite(statistics.turn).all():
                return 0.0  # a silent station completes no hold
            if self._last is not None and not statistics.moved_from(self._last):
                return 0.0
            if self._moving(statistics.strayed, time_s[first:]) is not None:
                break
            still_s = float(time_s[-1] - time_s[first])
        return min(still_s, HOLD_S)

    def _check(self, frames: list[TrackerFrame]) -> int | None:
        statistics, time_s = _hold_statistics(frames), np.array([frame.received_s for frame in frames])
        if (moving := self._moving(statistics.strayed, time_s)) is not None:
            self.message = f"hold still: station {moving!r} moves"
            return None
        if self._last is not None and not statistics.moved_from(self._last):
            self._last = statistics  # slow drift while standing is no move
            return None
        inner = np.flatnonzero((time_s >= time_s[0] + EDGE_S) & (time_s <= time_s[-1] - EDGE_S)).tolist()
        kept = [replace(frames[row], suspect=frames[row].suspect | statistics.strayed[row]) for row in inner]
        try:
            still = measure_hold(kept, self.stations)
        except UnusableHold as error:
            self.message = f"hold still: {error.what}"
            heard = np.mean([frame.position_valid & frame.orientation_valid for frame in kept], axis=0) >= LEAST_SHARE
            return self._leave_out(statistics, heard)
        self._last = statistics
        return self._held(kept, still)

    def _moving(self, outside: Bools, time_s: Floats) -> str | None:
        """The station that moves, or None.

        A station moves when it is outside its sway limit for too long. At the beginning and at the end of the hold
        two stations have to be outside at the same time.
        """
        for when, least, share in (
            (time_s > -np.inf, 1, 1.0 - STEADY_SHARE),
            (time_s <= time_s[0] + 2.0 * EDGE_S, 2, 0.5),
            (time_s >= time_s[-1] - 2.0 * EDGE_S, 2, 0.5),
        ):
            strayed = outside[when].mean(axis=0)
            if np.sum(strayed > share) >= least:
                return self.stations[int(np.argmax(strayed))]
        return None

    def _leave_out(self, statistics: "_HoldStatistics", heard: Bools) -> int | None:
        """Leave out the wanted pose if the stations that are heard (S,) say that it is held; the number of poses done.

        None if it is not left out: the first pose never is, nor one in which all stations are heard.
        """
        wanted = len(self.holds)
        if (
            not 0 < wanted < self.poses
            or not 0.5 <= np.mean(heard) < 1.0
            or self.holds.count([]) >= MOST_LEFT_OUT
            or self._classifier is None
            or not self._classifier.matches(wanted, statistics.readings(heard), self._first)
        ):
            return None
        self._last = statistics
        self.holds.append([])
        silent = ", ".join(name for name, is_heard in zip(self.stations, heard, strict=True) if not is_heard)
        self.message = f"pose {wanted + 1} of {self.poses} left out: {silent} silent or lost"
        return wanted + 1

    def _held(self, frames: list[TrackerFrame], still: HoldReadings) -> int | None:
        """Take or reject a hold that differs from the last one; returns the number of complete poses or None."""
        began_s = frames[0].received_s - (self._began_s or 0.0)
        wanted = len(self.holds)
        if self.done:
            why = f"all {self.poses} poses were taken before"
        elif self._classifier is None or self._classifier.matches(wanted, still, self._first):
            self._first = self._first or still
            self.holds.append(frames)
            self.began_s.append(began_s)
            self.message = f"pose {wanted + 1} of {self.poses} taken"
            return wanted + 1
        else:
            nearest = self._classifier.nearest(still, self._first)
            looks = "none of the poses" if nearest is None else f"pose {nearest + 1}"
            why = f"that looks like {looks}, and pose {wanted + 1} is wanted"
        self.rejected.append(RejectedHold(began_s, why))
        self.message = str(self.rejected[-1])
        return None


@dataclass(frozen=True, eq=False)
class _HoldStatistics:
    """Median poses of S stations over F frames, computed fast; NaN for a station without readings."""

    middle_m: Floats
    """(S, 3)"""
    turn: Floats
    """(S, 4)"""
    strayed: Bools
    """(F, S) whether a reading is farther from the median than sway and the station's noise explain."""

    def readings(self, heard: Bools) -> HoldReadings:
        """The medians as readings, NaN for stations that are not heard (S,)."""
        zero = np.zeros(len(heard))
        return HoldReadings(HOLD_S, np.where(heard[:, None], self.middle_m, np.nan), self.turn, zero, zero)

    def moved_from(self, before: "_HoldStatistics") -> bool:
        moved_m = np.linalg.norm(self.middle_m - before.middle_m, axis=1)
        turned_rad = rotations.angle_between_rad(self.turn, before.turn)
        return bool(np.any(moved_m > MOVED_M) or np.any(turned_rad > MOVED_RAD))


def _hold_statistics(frames: Sequence[TrackerFrame]) -> _HoldStatistics:
    sound = np.array([frame.position_valid & frame.orientation_valid & ~frame.suspect for frame in frames])[..., None]
    seen_m = np.where(sound, np.array([frame.position_m for frame in frames]), np.nan)
    middle_m = _nan_median(seen_m)
    off_m = np.linalg.norm(seen_m - middle_m, axis=2)
    turn = np.where(sound, np.array([frame.tracker_from_station for frame in frames]), np.nan)
    largest = np.argmax(
        np.nan_to_num(np.abs(turn)).sum(axis=0), axis=1
    )  # q and -q are the same rotation: make the signs agree
    turn = turn * np.where(np.take_along_axis(turn, largest[None, :, None], axis=2) < 0.0, -1.0, 1.0)
    middle = _nan_median(turn)
    turned = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    return _HoldStatistics(middle_m, turned, off_m > SWAY_M + _nan_median(off_m))


def _nan_median(values: Floats) -> Floats:
    """Median over the first axis that ignores NaN; NaN where all values are."""
    middle = np.maximum(np.isfinite(values).sum(axis=0) - 1, 0) // 2
    out: Floats = np.take_along_axis(np.sort(values, axis=0), middle[None], axis=0)[0]
    return out
