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
        self._now: tuple[float, float] | None = None
        """Time and reception of the last frame [s]."""

    def of(self, frame: TrackerFrame) -> float:
        """The time of the next frame since the first [s]; by the host's clock where no stamp can be used."""
        stamps = [
            (row, stamp_s)
            for row, (stamp_s, suspect) in enumerate(
                zip(frame.measured_s.tolist(), frame.suspect.tolist(), strict=True)
            )
            if stamp_s == stamp_s and not suspect
        ]
        now_s = self._by_stamps(stamps, frame.received_s)
        for row, stamp_s in stamps:
            self._known[row] = stamp_s, now_s
        self._now = now_s, frame.received_s
        return now_s

    def _by_stamps(self, stamps: list[tuple[int, float]], received_s: float) -> float:
        if self._now is None:
            return 0.0
        for row, stamp_s in stamps:
            if row in self._known:
                before_s, at_s = self._known[row]
                return max(at_s + stamp_s - before_s, self._now[0])
        return self._now[0] + received_s - self._now[1]
