"""One stream of frames from a line that is configured more than once; no input or output.

A live driver or a replay reports what happened on the line and when. The frames depend on that alone.
"""

from dataclasses import replace

import numpy as np

from harness.stream.codec.reader import ByteCapture, FrameReader, WireFormat
from harness.stream.frame import TrackerFrame

SILENCE_PERIODS = 2.0
"""Every unfinished frame is overdue after this many periods without a byte."""


class ContinuousFrameReader:
    """Frames of consecutive sessions: host times strictly increase, and device time never steps back.

    Each configuration resets the device's clock. Device time then continues by the host's clock from the first bytes
    that arrive, because a replay knows that moment as exactly as the live driver.
    """

    def __init__(self) -> None:
        self.device_zero_s = 0.0
        """The value of `measured_s` at which the device's own clock is zero [s]."""
        self._reader: FrameReader | None = None
        self._period_s = 0.0
        self._last_byte_s = self._last_frame_s = -np.inf
        """Host time of the last byte or configuration, and of the last frame [s]."""
        self._is_new = False
        """True until the first bytes after a configuration."""
        self._device_s = 0.0
        """Latest device time of any frame [s]."""
        self._totals = dict.fromkeys(("sessions", "records", "garbage_bytes", "clock_resets", "out_of_range"), 0)
        """Counts of the earlier sessions."""
        self._frames = 0

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of sessions, frames, records, garbage bytes, clock resets and positions beyond the list's range."""
        reader = self._reader
        names = [name for name in self._totals if name != "sessions"]
        current = {} if reader is None else {name: int(np.sum(getattr(reader, name))) for name in names}
        return {"frames": self._frames} | {name: n + current.get(name, 0) for name, n in self._totals.items()}

    @property
    def reader(self) -> FrameReader | None:
        """Reader of the present session; None before the first configuration."""
        return self._reader

    @property
    def silent_from_s(self) -> float:
        """When every unfinished frame is overdue if no byte arrives before [s]."""
        return self._last_byte_s + SILENCE_PERIODS * self._period_s

    def begin_session(self, wire: WireFormat, now_s: float) -> list[TrackerFrame]:
        """Start a session: later bytes have this format, and the device's clock starts at zero if `wire` says so.

        Returns the unfinished frame of the session before.
        """
        frames = self.finish()
        self._totals["sessions"] += 1
        self._reader, self._period_s = FrameReader(wire, now_s if wire.zeroed else None), 1.0 / wire.rate_hz
        self._last_byte_s, self._is_new = now_s, True
        return frames

    def feed(self, data: bytes, now_s: float) -> list[TrackerFrame]:
        """Return the frames that these bytes complete; none before the first configuration."""
        return self.feed_all(ByteCapture(data, np.array([len(data)]), np.array([now_s])))

    def feed_all(self, capture: ByteCapture) -> list[TrackerFrame]:
        """Return the frames that one or more chunks complete."""
        if self._reader is None or not len(capture.ends):
            return []
        if self._is_new and self._frames:
            self.device_zero_s = self._device_s + max(float(capture.received_s[0]) - self._last_frame_s, 0.0)
        self._is_new = False
        self._last_byte_s = float(capture.received_s[-1])
        return self._to_stream_time(self._reader.feed_all(capture))

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """Return the frame that is overdue at `now_s` [s].

        Call it only after a read that found nothing: bytes that a busy host has not read yet must not cost their frame.
        """
        return [] if self._reader is None else self._to_stream_time(self._reader.expire(now_s))

    def finish(self) -> list[TrackerFrame]:
        """End the session and return its unfinished frame."""
        if self._reader is None:
            return []
        frames = self._to_stream_time(self._reader.finish())
        self._totals, self._reader = {name: n for name, n in self.counts.items() if name != "frames"}, None
        return frames

    def _to_stream_time(self, frames: list[TrackerFrame]) -> list[TrackerFrame]:
        """Convert the frames to the time of the whole stream."""
        out = []
        for frame in frames:
            if self.device_zero_s:
                frame = replace(frame, measured_s=frame.measured_s + self.device_zero_s)
            if frame.received_s <= self._last_frame_s:
                frame = replace(frame, received_s=float(np.nextafter(self._last_frame_s, np.inf)))
            self._last_frame_s = frame.received_s
            self._device_s = float(np.fmax.reduce(frame.measured_s, initial=self._device_s))
            out.append(frame)
        self._frames += len(out)
        return out
