"""A recording as a stream: the same decoder on a virtual clock, at any speed.

The content of frames depends on the recorded bytes and times alone, never on the speed. Frames carry the recorded times
of reception. Frames that the driver closed on a timeout are closed at the same moment of the virtual clock.
"""

import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from threading import Event
from typing import Any, Literal

import numpy as np

from harness.errors import BadFile, BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.reader import ByteCapture, ContinuousFrameReader, WireFormat
from harness.stream.recording.block_content import EXPECTED_FILE, wire_format_of
from harness.stream.recording.blocks import CONFIGURED, RECEIVED
from harness.stream.recording.recording import Recording, read_recording

CHUNKS_PER_BATCH = 1000
"""Chunks that are decoded together where the replay does not wait for the clock."""
ReplaySpeed = float | Literal["step", "max"]
"""A factor of the recorded speed; "step" for one frame at a time; "max" for no waiting."""


def parse_speed(text: str) -> ReplaySpeed:
    """Parse `step`, `max`, or a positive number. Raises BadInput."""
    if text in ("step", "max"):
        return "step" if text == "step" else "max"
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0.0 < speed < math.inf:
        raise BadInput(f"Speed {text!r} is not possible.", "Give `step`, `max`, or a positive number; 1 is real time.")
    return speed


def wait_for_enter() -> bool:
    """Wait for the Enter key. Returns False at the end of the input."""
    return bool(sys.stdin.readline())


def pace_frames(
    due_frames: Iterable[tuple[float, TrackerFrame]], speed: ReplaySpeed, step: Callable[[], bool], closed: Event
) -> Iterator[TrackerFrame]:
    """Yield frames at the times at which they are due [s], at this speed, until `closed` is set."""
    began_s = first_s = None
    for due_s, frame in due_frames:
        if isinstance(speed, float):
            if began_s is None or first_s is None:
                began_s, first_s = time.monotonic(), due_s
            closed.wait(began_s + (due_s - first_s) / speed - time.monotonic())
        if closed.is_set() or (speed == "step" and not step()):
            return
        yield frame


class RecordingStream:
    """A `TrackerStream` over a recording; every iteration starts at its beginning.

    Where the device was configured again, or the recording was continued, the stream goes on. Device time then advances
    by the host's clock, and the host's clock by the wall clock where it began anew. Raises BadFile for a recording that
    cannot be read, was never configured, or changes its stations.
    """

    def __init__(
        self,
        recording: Recording | Path | str,
        speed: ReplaySpeed = "max",
        *,
        step: Callable[[], bool] = wait_for_enter,
    ) -> None:
        """Open a recording.

        At speed "step", `step` waits for permission to yield the next frame; it returns False to end the iteration.
        """
        self.recording = recording if isinstance(recording, Recording) else read_recording(recording)
        formats = self.recording.formats
        if not formats:
            damage = "; ".join(self.recording.damage)
            problem = "the device was never configured in it" + (f" ({damage})" if damage else "")
            raise BadFile(self.recording.path, problem, EXPECTED_FILE, "It contains no frames.")
        for wire in formats[1:]:
            if wire.stations != formats[0].stations:
                problem = f"stations {', '.join(formats[0].stations)} become {', '.join(wire.stations)}"
                advice = "Replay the parts separately."
                raise BadFile(self.recording.path, problem, "the same stations throughout", advice)
        self.wire: WireFormat = formats[0]
        """The wire format of the first configuration."""
        self._speed, self._step = speed, step
        self._wall_ahead_s = 0.0
        self._reader = ContinuousFrameReader()
        self._closed = Event()

    @property
    def stations(self) -> tuple[str, ...]:
        """Station names, in the order of the device's stations."""
        return self.wire.stations

    @property
    def path(self) -> Path:
        """The file of the recording."""
        return self.recording.path

    @property
    def note(self) -> dict[str, Any]:
        """The latest note on the origin of the recording; empty when there is none."""
        return self.recording.note

    @property
    def rate_hz(self) -> float:
        """Rate of each station that the driver read [Hz]."""
        return self.wire.rate_hz

    @property
    def device_zero_s(self) -> float:
        """The value of `measured_s` at which the device's own clock was zero, for the latest frame [s]."""
        return self._reader.device_zero_s

    @property
    def counts(self) -> dict[str, int]:
        """Counts of what was read so far (see `ContinuousFrameReader.counts`)."""
        return self._reader.counts

    def close(self) -> None:
        """End the iteration; may be called from any thread."""
        self._closed.set()

    def wall_s(self, received_s: float) -> float:
        """Wall clock at a time of the host's monotonic clock [s], as they were related at the latest configuration."""
        return received_s + self._wall_ahead_s

    def __iter__(self) -> Iterator[TrackerFrame]:
        return pace_frames(self._due_frames(), self._speed, self._step, self._closed)

    def _due_frames(self) -> Iterator[tuple[float, TrackerFrame]]:
        """Yield every frame with the time at which it is due on the virtual clock [s]."""
        self._reader = reader = ContinuousFrameReader()
        batch_size = 1 if isinstance(self._speed, float) else CHUNKS_PER_BATCH
        now_s, wall_s, shift_s = -math.inf, 0.0, 0.0
        waiting: list[tuple[float, bytes]] = []

        def due(frames: list[TrackerFrame]) -> list[tuple[float, TrackerFrame]]:
            return [(now_s, frame) for frame in frames]

        def decode() -> list[tuple[float, TrackerFrame]]:
            """The frames of the chunks that wait."""
            times_s, chunks = [at_s for at_s, _ in waiting], [data for _, data in waiting]
            waiting.clear()
            ends = np.cumsum([len(data) for data in chunks], dtype=np.int64)
            return due(reader.feed_all(ByteCapture(b"".join(chunks), ends, np.array(times_s))))

        for block in self.recording.blocks():
            if block.kind == RECEIVED and block.payload:
                now_s, wall_s = block.monotonic_s + shift_s, block.wall_s
                waiting.append((now_s, block.payload))
                if len(waiting) >= batch_size:
                    yield from decode()
            elif block.kind == RECEIVED:
                yield from decode()
                now_s, wall_s = block.monotonic_s + shift_s, block.wall_s
                yield from due(reader.expire(now_s))
            elif block.kind == CONFIGURED:
                yield from decode()
                yield from due(reader.finish())
                wire = wire_format_of(self.path, block)
                if block.monotonic_s + shift_s < now_s:  # recorded after a restart of the computer
                    pause_s = max(block.wall_s - wall_s, 1.0 / wire.rate_hz)
                    shift_s = now_s + pause_s - block.monotonic_s
                now_s, wall_s = block.monotonic_s + shift_s, block.wall_s
                self._wall_ahead_s = wall_s - now_s
                reader.begin_session(wire, now_s)
        yield from decode()
        yield from due(reader.finish())
