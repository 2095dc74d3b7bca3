"""Finds the poses that a performer holds, one after another, in a stream: live or from a recording.

A hold is `HOLD_S` in which every station is still (by the rules of `still`), with its beginning and end left out.
The next one counts when a station has been somewhere else in between and is there now; and, where it is known what
the poses look like, when it looks like the pose that is wanted: a rest, a repeated pose or one that was left out
never shifts the order.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.calibrate.likeness import Likeness
from harness.calibrate.still import SWAY_M, NotStanding, Still, span_s, stood_still
from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame

HOLD_S, EDGE_S = 2.7, 0.25
"""A hold, and what is left out of it at either end [s]; what remains is `still.LEAST_S` and two periods of 10 Hz."""
LOOK_S = 0.2
"""So often it is looked whether somebody holds still [choice]."""
GAP_S = 0.5
"""After so long without a frame, nobody knows what the performer did [choice]."""
MOVED_M, MOVED_RAD = 0.10, float(np.deg2rad(20.0))
"""A station that is this far from where it was in the last hold has moved: three times what is still [choice]."""


@dataclass(frozen=True)
class Passed:
    """A hold that was not taken."""

    began_s: float
    """Since the first frame [s]."""
    why: str

    def __str__(self) -> str:
        return f"not taken what was held from {self.began_s:.1f} s on: {self.why}"


class PoseCollector:
    """Takes the holds of so many poses, in their order; `likeness` knows what they look like."""

    def __init__(self, stations: Sequence[str], poses: int = 8, likeness: Likeness | None = None) -> None:
        self.stations, self.poses = tuple(stations), poses
        self.held: list[list[TrackerFrame]] = []
        """Frames of each pose taken, without the edges."""
        self.began_s: list[float] = []
        """When each of them began, since the first frame [s]."""
        self.passed: list[Passed] = []
        """Holds that were not taken, and why."""
        self.told = ""
        """What is going on, for the performer."""
        self._likeness = likeness
        self._window: deque[TrackerFrame] = deque()
        self._began_s: float | None = None
        self._looked_s = -np.inf
        self._first: Still | None = None
        self._last: Still | None = None

    @property
    def done(self) -> bool:
        return len(self.held) >= self.poses

    def add(self, frame: TrackerFrame) -> int | None:
        """How many poses are complete, when one just was."""
        now_s, window = frame.received_s, self._window
        self._began_s = now_s if self._began_s is None else self._began_s
        if window and now_s - window[-1].received_s > GAP_S:
            window.clear()
        window.append(frame)
        while len(window) > 2 and now_s - window[1].received_s >= HOLD_S:
            window.popleft()
        if now_s - self._looked_s < LOOK_S or span_s(window) < HOLD_S:
            return None
        self._looked_s = now_s
        return self._look(list(window))

    def _look(self, frames: list[TrackerFrame]) -> int | None:
        if (moving := self._moving(frames)) is not None:  # cheap, and most of what is looked at
            self.told = f"hold still: station {moving!r} moves"
            return None
        try:
            still = stood_still(_inner(frames), self.stations)
        except NotStanding as error:
            self.told = f"hold still: {error.what}"
            return None
        same = self._last is not None and not _elsewhere(still, self._last)
        self._last = still  # whoever drifts while standing has not moved
        return None if same else self._held(frames, still)

    def _held(self, frames: list[TrackerFrame], still: Still) -> int | None:
        """A hold that is none of those before."""
        began_s = frames[0].received_s - (self._began_s or 0.0)
        wanted = len(self.held)
        if self.done:
            why = f"all {self.poses} poses were taken before"
        elif self._likeness is None or self._likeness.held(wanted, still, self._first):
            self._first = self._first or still
            self.held.append(_inner(frames))
            self.began_s.append(began_s)
            self.told = f"pose {wanted + 1} of {self.poses} taken"
            return wanted + 1
        else:
            nearest = self._likeness.nearest(still, self._first)
            looks = "none of the poses" if nearest is None else f"pose {nearest + 1}"
            why = f"that looks like {looks}, and pose {wanted + 1} is wanted"
        self.passed.append(Passed(began_s, why))
        self.told = str(self.passed[-1])
        return None

    def _moving(self, frames: Sequence[TrackerFrame]) -> str | None:
        """A station that is not where it is on the whole as the hold begins, or as it ends."""
        position_m, time_s = _seen_m(frames), np.array([frame.received_s for frame in frames])
        middle_m = _median(position_m)
        near_m = SWAY_M + _median(np.linalg.norm(position_m - middle_m, axis=2))
        for edge in (time_s <= time_s[0] + 2.0 * EDGE_S, time_s >= time_s[-1] - 2.0 * EDGE_S):
            off_m = np.linalg.norm(_median(position_m[edge]) - middle_m, axis=1)
            if (off_m > near_m).any():  # NaN, not seen for this while, is not
                return self.stations[int(np.argmax(off_m > near_m))]
        return None


def _inner(frames: Sequence[TrackerFrame]) -> list[TrackerFrame]:
    first_s, last_s = frames[0].received_s + EDGE_S, frames[-1].received_s - EDGE_S
    return [frame for frame in frames if first_s <= frame.received_s <= last_s]


def _seen_m(frames: Sequence[TrackerFrame]) -> Floats:
    """(F, S, 3) NaN where nothing of use came."""
    seen = [frame.position_valid & ~frame.suspect for frame in frames]
    return np.where(np.array(seen)[..., None], np.array([frame.position_m for frame in frames]), np.nan)


def _median(values: Floats) -> Floats:
    """Over the first axis, of what is not NaN; NaN where all is."""
    out = np.full(values.shape[1:], np.nan)
    some = np.isfinite(values).any(axis=0)
    out[some] = np.nanmedian(values[:, some], axis=0)
    return out


def _elsewhere(now: Still, before: Still) -> bool:
    moved_m = np.linalg.norm(now.position_m - before.position_m, axis=1)
    turned_rad = rotations.angle_between_rad(now.tracker_from_station, before.tracker_from_station)
    return bool(np.any(moved_m > MOVED_M) or np.any(turned_rad > MOVED_RAD))
