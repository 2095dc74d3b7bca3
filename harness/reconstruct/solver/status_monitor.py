"""Status of an estimate, by the number of stations that report (docs/papers.md E, "lost tracker")."""

import math

from harness.core.estimate import LOST_AFTER_S, Status
from harness.reconstruct.solver.device_time import DeviceTime
from harness.stream.frame import TrackerFrame


class StatusMonitor:
    """Monitor of one session's frames; a station reports when its position or its orientation is valid."""

    def __init__(self, clock: DeviceTime | None = None) -> None:
        """`clock` is that of the session; without one the monitor has its own."""
        self._time, self._enough_at_s = clock or DeviceTime(), -math.inf

    def update(self, frame: TrackerFrame) -> tuple[Status, bool]:
        """The status of this frame, and whether any station reports at all.

        SOLVED with at least half of the stations; otherwise HELD, and LOST after `LOST_AFTER_S`.
        """
        now_s = self._time.frame_time_s(frame)
        count = (frame.position_valid | frame.orientation_valid).tobytes().count(True)
        if 2 * count >= len(frame.position_valid) and count:
            self._enough_at_s = now_s
            return Status.SOLVED, True
        if self._enough_at_s == -math.inf:
            self._enough_at_s = now_s
        lost = now_s - self._enough_at_s > LOST_AFTER_S
        return Status.LOST if lost else Status.HELD, count > 0
