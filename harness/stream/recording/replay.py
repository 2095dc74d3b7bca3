"""A recording as a stream: the same decoder on a virtual clock, at any speed.

What a frame says depends on the recorded bytes and times alone, never on the speed. Frames carry the recorded times
of reception. Frames that the driver gave up waiting for are given up at the same moment of the virtual clock.
"""

import math
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event
from typing import Literal

import numpy as np

from harness.errors import BadFile, BadInput
from harness.stream.codec.blocks import CONFIGURED, RECEIVED
from harness.stream.codec.capture import ByteCapture
from harness.stream.codec.continuous_reader import ContinuousFrameReader
from harness.stream.codec.reader import WireFormat
from harness.stream.frame import TrackerFrame
from harness.stream.recording.recording import EXPECTED_FILE, Recording, read_recording

CHUNKS_PER_BATCH = 1000
"""Chunks that are decoded together where nobody waits for the clock."""
ReplaySpeed = float | Literal["step", "max"]
"""So many times as fast as it was, a frame at a time, or without waiting."""


def parse_speed(text: str) -> ReplaySpeed:
    """`step`, `max`, or a positive number; BadInput."""
    if text in ("step", "max"):
        return "step" if text == "step" else "max"
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0.0 < speed < math.inf:
        raise BadInput(f"Speed {text!r}.", "It is `step`, `max`, or a positive number: 1 is as it was.")
    return speed


def wait_for_enter() -> bool:
    """Wait for Enter; False at the end of the input."""
    return bool(sys.stdin.readline())


class RecordingStream:
    """A `TrackerStream` over a recording; every iteration is from its beginning.

    Where the device was set up anew, or the recording was continued, the stream goes on: device time by the host's
    clock, and the host's clock by the wall's where it began anew. BadFile for a recording that cannot be read, was
    never set up, or changes its stations.
    """

    def __init__(
        self,
        recording: Recording | Path | str,
        speed: ReplaySpeed = "max",
        *,
        step: Callable[[], bool] = wait_for_enter,
    ) -> None:
        """`step` waits for leave to give the next frame where the speed is `step`, and says False to end."""
        self.recording = recording if isinstance(recording, Recording) else read_recording(recording)
        formats = self.recording.formats
        if not formats:
            lost = "; ".join(self.recording.damage)
            found = "the device was never set up in it" + (f" ({lost})" if lost else "")
            raise BadFile(self.recording.path, found, EXPECTED_FILE, "There are no frames in it.")
        for wire in formats[1:]:
            if wire.stations != formats[0].stations:
                found = f"stations {', '.join(formats[0].stations)} become {', '.join(wire.stations)}"
                raise BadFile(self.recording.path, found, "the same stations throughout", "Replay the parts apart.")
        self.wire: WireFormat = formats[0]
        """As it was first set up."""
        self._speed, self._step = speed, step
        self._wall_ahead_s = 0.0
        self._played_by = ContinuousFrameReader()
        self._closed = Event()

    @property
    def stations(self) -> tuple[str, ...]:
        return self.wire.stations

    @property
    def device_zero_s(self) -> float:
        """What `measured_s` of the frame given last is where the device's own clock is zero [s]."""
        return self._played_by.device_zero_s

    @property
    def counts(self) -> dict[str, int]:
        """Of what was read so far (see `ContinuousFrameReader.counts`)."""
        return self._played_by.counts

    def close(self) -> None:
        self._closed.set()

    def wall_s(self, received_s: float) -> float:
        """Wall clock at a moment of the host's monotonic clock, as it was when the device was set up last."""
        return received_s + self._wall_ahead_s

    def __iter__(self) -> Iterator[TrackerFrame]:
        began_s = first_s = None
        for due_s, frame in self._played():
            if isinstance(self._speed, float):
                if began_s is None or first_s is None:
                    began_s, first_s = time.monotonic(), due_s
                self._closed.wait(began_s + (due_s - first_s) / self._speed - time.monotonic())
            if self._closed.is_set() or (self._speed == "step" and not self._step()):
                return
            yield frame

    def _played(self) -> Iterator[tuple[float, TrackerFrame]]:
        """Every frame, and when it was due by the virtual clock [s]."""
        self._played_by = sessions = ContinuousFrameReader()
        at_once = 1 if isinstance(self._speed, float) else CHUNKS_PER_BATCH
        now_s, wall_s, shift_s = -math.inf, 0.0, 0.0
        waiting: list[tuple[float, bytes]] = []
        for block in self.recording.blocks():
            if block.kind == RECEIVED and block.payload:
                now_s, wall_s = block.monotonic_s + shift_s, block.wall_s
                waiting.append((now_s, block.payload))
                if len(waiting) >= at_once:
                    yield from _with_due_time(now_s, sessions.feed_all(_concatenate_chunks(waiting)))
            elif block.kind == RECEIVED:
                yield from _with_due_time(now_s, sessions.feed_all(_concatenate_chunks(waiting)))
                now_s, wall_s = block.monotonic_s + shift_s, block.wall_s
                yield from _with_due_time(now_s, sessions.expire(now_s))
            elif block.kind == CONFIGURED:
                yield from _with_due_time(now_s, sessions.feed_all(_concatenate_chunks(waiting)))
                yield from _with_due_time(now_s, sessions.finish())
                wire = self.recording.format_of(block)
                if block.monotonic_s + shift_s < now_s:  # recorded after a restart of the computer
                    pause_s = max(block.wall_s - wall_s, 1.0 / wire.rate_hz)
                    shift_s = now_s + pause_s - block.monotonic_s
                now_s, wall_s = block.monotonic_s + shift_s, block.wall_s
                self._wall_ahead_s = wall_s - now_s
                sessions.begin_session(wire, now_s)
        yield from _with_due_time(now_s, sessions.feed_all(_concatenate_chunks(waiting)))
        yield from _with_due_time(now_s, sessions.finish())


def _with_due_time(now_s: float, frames: list[TrackerFrame]) -> Iterator[tuple[float, TrackerFrame]]:
    return ((now_s, frame) for frame in frames)


def _concatenate_chunks(waiting: list[tuple[float, bytes]]) -> ByteCapture:
    """The chunks as one capture; they wait no longer."""
    received_s, chunks = [now_s for now_s, _ in waiting], [data for _, data in waiting]
    waiting.clear()
    return ByteCapture(
        b"".join(chunks), np.cumsum([len(data) for data in chunks], dtype=np.int64), np.array(received_s)
    )
