"""A line that is set up more than once, as one stream: one `FrameReader` after another, without input or output.

Whoever reads a line, now or from a recording, tells this what happened and when; frames follow from that alone.
"""

from dataclasses import replace

import numpy as np

from harness.stream.codec.capture import ByteCapture
from harness.stream.codec.reader import FrameReader, WireFormat
from harness.stream.frame import TrackerFrame

SILENCE_PERIODS = 2.0
"""After so many periods without a byte every unfinished frame is due."""


class ContinuousFrameReader:
    """Frames of one session after another: host times strictly increase, device time never steps back.

    The device's clock begins anew when it is set up; device time then goes on by the host's clock, from the first
    bytes that come: whoever reads a recording knows that moment as exactly as whoever recorded it.
    """

    def __init__(self) -> None:
        self.device_zero_s = 0.0
        """What `measured_s` is where the device's own clock is zero [s]."""
        self._reader: FrameReader | None = None
        self._period_s = 0.0
        self._heard_s = self._framed_s = -np.inf
        """Host time of the last byte or set-up, and of the last frame [s]."""
        self._new = False
        """Nothing has come since it was set up."""
        self._device_s = 0.0
        """Latest device time of any frame [s]."""
        self._before = dict.fromkeys(("sessions", "records", "garbage_bytes", "clock_resets"), 0)
        self._frames = 0

    @property
    def counts(self) -> dict[str, int]:
        """Sessions, frames, records, bytes that belong to nothing, and how often the device's clock was set anew."""
        reader = self._reader
        now = {} if reader is None else {name: getattr(reader, name) for name in self._before if name != "sessions"}
        return {"frames": self._frames} | {name: n + now.get(name, 0) for name, n in self._before.items()}

    @property
    def reader(self) -> FrameReader | None:
        """Of the session that runs; None before the first set-up."""
        return self._reader

    @property
    def silent_from_s(self) -> float:
        """When every unfinished frame is due if no byte comes before."""
        return self._heard_s + SILENCE_PERIODS * self._period_s

    def begin_session(self, wire: WireFormat, now_s: float) -> list[TrackerFrame]:
        """What was unfinished; from here on bytes are read with this format, and the device's clock began at zero."""
        frames = self.finish()
        self._before["sessions"] += 1
        self._reader, self._period_s = FrameReader(wire), 1.0 / wire.rate_hz
        self._heard_s, self._new = now_s, True
        return frames

    def feed(self, data: bytes, now_s: float) -> list[TrackerFrame]:
        """What these bytes complete; nothing unless it is set up."""
        return self.feed_all(ByteCapture(data, np.array([len(data)]), np.array([now_s])))

    def feed_all(self, capture: ByteCapture) -> list[TrackerFrame]:
        """The same of one chunk or more at once."""
        if self._reader is None or not len(capture.ends):
            return []
        if self._new and self._frames:
            self.device_zero_s = self._device_s + max(float(capture.received_s[0]) - self._framed_s, 0.0)
        self._new = False
        self._heard_s = float(capture.received_s[-1])
        return self._placed(self._reader.feed_all(capture))

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """The frame that has waited too long at this moment. To be asked when the line was looked at and nothing was
        there: bytes that a busy host has not read yet must not cost their frame.
        """
        return [] if self._reader is None else self._placed(self._reader.expire(now_s))

    def finish(self) -> list[TrackerFrame]:
        """What is left at the end of a session."""
        if self._reader is None:
            return []
        frames = self._placed(self._reader.finish())
        self._before, self._reader = {name: n for name, n in self.counts.items() if name != "frames"}, None
        return frames

    def _placed(self, frames: list[TrackerFrame]) -> list[TrackerFrame]:
        """The frames in the time of the whole stream."""
        out = []
        for frame in frames:
            if self.device_zero_s:
                frame = replace(frame, measured_s=frame.measured_s + self.device_zero_s)
            if frame.received_s <= self._framed_s:
                frame = replace(frame, received_s=float(np.nextafter(self._framed_s, np.inf)))
            self._framed_s = frame.received_s
            self._device_s = float(np.fmax.reduce(frame.measured_s, initial=self._device_s))
            out.append(frame)
        self._frames += len(out)
        return out
