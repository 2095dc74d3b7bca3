"""Time of each frame by the device's clock, and the status of an estimate by the stations that report.

A busy host receives frames late and in bursts, which must not look like motion. So methods use the device's clock, and
a stream that is simulated, recorded or read from a port gives the same results bit for bit. Time starts at 0 with the
first frame, and advances by the difference of the time stamps of any one station. docs/papers.md E, "lost tracker",
has the status.
"""

import math

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.estimate import LOST_AFTER_S, Status
from harness.stream import TrackerFrame


class DeviceTime:
    """Clock of one session, driven by the time stamps of its frames."""

    def __init__(self) -> None:
        self._stamps: Floats = np.empty((2, 0))
        """(2, S) the last time stamp of each station, NaN before the first, and the time of that frame [s]."""
        self._host_s, self._host_at_s = math.nan, 0.0
        """Host time of the first frame, or of the last frame with a usable time stamp, and its time here [s]."""
        self._now_s = 0.0
        self._frame: TrackerFrame | None = None
        """The last frame: the parts of a session share one clock, and each asks for the time of every frame."""

    def frame_time_s(self, frame: TrackerFrame) -> float:
        """Time of the next frame since the first [s]; by the host's clock when no time stamp is usable.

        The frame of the last call may be given again; its time is the same.
        """
        if frame is not self._frame:
            self._frame = frame
            self._advance(frame)
        return self._now_s

    def _advance(self, frame: TrackerFrame) -> None:
        """Advance to a frame, and keep its time stamps."""
        if self._stamps.shape[1] != len(frame.measured_s):
            self._stamps = np.full((2, len(frame.measured_s)), np.nan)
        by_stamps, self._now_s = _advance_by_stamps(frame.measured_s, frame.suspect, self._stamps, self._now_s)
        if not by_stamps and not math.isnan(self._host_s):
            self._now_s = max(self._host_at_s + frame.received_s - self._host_s, self._now_s)
            self._stamps[1, ~np.isnan(frame.measured_s) & ~frame.suspect] = self._now_s
        else:
            self._host_s, self._host_at_s = frame.received_s, self._now_s


class StatusMonitor:
    """Monitor of one session's frames; a station reports when its position or its orientation is valid."""

    def __init__(self, clock: DeviceTime | None = None) -> None:
        """`clock` is that of the session; without one the monitor has its own."""
        self._time, self._enough_at_s = clock or DeviceTime(), -math.inf

    def update(self, frame: TrackerFrame, sure: int = 0) -> tuple[Status, bool]:
        """The status of this frame, and whether any station reports at all.

        SOLVED with at least half of the stations; otherwise HELD, and LOST after `LOST_AFTER_S`. A station counts when
        it reports. Where others are predicted, `sure` is the number of stations that report or are surely predicted.
        """
        now_s = self._time.frame_time_s(frame)
        reporting = (frame.position_valid | frame.orientation_valid).tobytes().count(True)
        count = max(reporting, sure)
        if 2 * count >= len(frame.position_valid) and count:
            self._enough_at_s = now_s
            return Status.SOLVED, reporting > 0
        if self._enough_at_s == -math.inf:
            self._enough_at_s = now_s
        lost = now_s - self._enough_at_s > LOST_AFTER_S
        return Status.LOST if lost else Status.HELD, reporting > 0


@compiled
def _advance_by_stamps(measured_s: Floats, suspect: Bools, stamps: Floats, now_s: float) -> tuple[bool, float]:
    """Whether any usable time stamp (S,) has a predecessor in `stamps` (2, S), and the time of the frame by the first.

    `stamps` takes the usable ones.
    """
    found = False
    for row in range(len(measured_s)):
        usable = not (np.isnan(measured_s[row]) or suspect[row])
        if usable and not found and not np.isnan(stamps[0, row]):
            found = True
            now_s = max(stamps[1, row] + measured_s[row] - stamps[0, row], now_s)
    for row in range(len(measured_s)):
        if not (np.isnan(measured_s[row]) or suspect[row]):
            stamps[0, row], stamps[1, row] = measured_s[row], now_s
    return found, now_s
