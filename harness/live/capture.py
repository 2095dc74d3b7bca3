"""The capture thread, which only reads the tracker, so that no byte waits while a pose is solved."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Thread

from harness.live.dropping_queue import DroppingQueue
from harness.stream.frame import TrackerFrame, TrackerStream


@dataclass(frozen=True, slots=True)
class CapturedFrame:
    """A frame, and when it came out of the stream."""

    frame: TrackerFrame
    captured_s: float
    """Host monotonic clock when the stream delivered the frame [s]."""


class CaptureThread:
    """Moves frames from a stream to a queue; the queue ends when the stream ends."""

    def __init__(
        self, stream: TrackerStream, queue: DroppingQueue[CapturedFrame], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._stream, self._queue, self._clock = stream, queue, clock
        self._thread = Thread(target=self._run, name="capture")
        self.frames = 0
        self.error: Exception | None = None
        """The error that ended the stream; None after a normal end."""

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Close the stream and wait for the thread to end; may be called repeatedly, and before `start`."""
        self._stream.close()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            for frame in self._stream:
                self.frames += 1
                self._queue.put(CapturedFrame(frame, self._clock()))
        except Exception as error:  # `run_session` raises it again
            self.error = error
        finally:
            self._queue.end()
