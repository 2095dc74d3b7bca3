"""Time of measurement of each frame, by the device's clock.

A busy host receives frames late and in bursts, which must not look like motion. So methods use the device's clock, and
a stream that is simulated, recorded or read from a port gives the same results bit for bit. Time starts at 0 with the
first frame, and advances by the difference of the time stamps of any one station.
"""

from harness.stream.frame import TrackerFrame


class DeviceTime:
    """Clock of one session, driven by the time stamps of its frames."""

    def __init__(self) -> None:
        self._last_stamps: dict[int, tuple[float, float]] = {}
        """Row of a station -> its last time stamp and the time of that frame [s]."""
        self._host: tuple[float, float] | None = None
        """Time and host time of the first frame, or of the last frame with a usable time stamp [s]."""
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
        stamps = [
            (row, stamp_s)
            for row, (stamp_s, suspect) in enumerate(
                zip(frame.measured_s.tolist(), frame.suspect.tolist(), strict=True)
            )
            if stamp_s == stamp_s and not suspect
        ]
        match = next(((row, stamp_s) for row, stamp_s in stamps if row in self._last_stamps), None)
        if match is not None:
            before_s, at_s = self._last_stamps[match[0]]
            self._now_s = max(at_s + match[1] - before_s, self._now_s)
            self._host = self._now_s, frame.received_s
        elif self._host is not None:
            self._now_s = max(self._host[0] + frame.received_s - self._host[1], self._now_s)
        else:
            self._host = self._now_s, frame.received_s
        for row, stamp_s in stamps:
            self._last_stamps[row] = stamp_s, self._now_s
