"""When a frame was measured: a busy host takes frames late and in bursts, which must not look like motion.

So methods go by the device's clock, and a stream replayed, recorded or read from a port gives the same answers, bit
by bit. Time begins with the first frame, and goes on by what the stamp of any one station went on.
"""

from harness.stream.frame import TrackerFrame


class DeviceTime:
    """Watches the frames of one session."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[float, float]] = {}
        """Row of a station -> its last stamp, and the time of the frame that brought it [s]."""
        self._host: tuple[float, float] | None = None
        """Time and reception of the first frame, or of the last that had a stamp to go by [s]."""
        self._now_s = 0.0

    def frame_time_s(self, frame: TrackerFrame) -> float:
        """The time of the next frame since the first [s]; by the host's clock where no stamp can be used."""
        stamps = [
            (row, stamp_s)
            for row, (stamp_s, suspect) in enumerate(
                zip(frame.measured_s.tolist(), frame.suspect.tolist(), strict=True)
            )
            if stamp_s == stamp_s and not suspect
        ]
        known = next(((row, stamp_s) for row, stamp_s in stamps if row in self._known), None)
        if known is not None:
            before_s, at_s = self._known[known[0]]
            self._now_s = max(at_s + known[1] - before_s, self._now_s)
            self._host = self._now_s, frame.received_s
        elif self._host is not None:
            self._now_s = max(self._host[0] + frame.received_s - self._host[1], self._now_s)
        else:
            self._host = self._now_s, frame.received_s
        for row, stamp_s in stamps:
            self._known[row] = stamp_s, self._now_s
        return self._now_s
