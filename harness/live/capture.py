"""The thread that reads the tracker and does nothing else, so that no byte waits for a pose to be solved."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Thread

from harness.live.dropping_queue import DroppingQueue
from harness.stream.frame import TrackerFrame, TrackerStream


@dataclass(frozen=True, slots=True)
class CapturedFrame:
    """A frame as it came out of the stream."""

    frame: TrackerFrame
    captured_s: float
    """Host monotonic clock then [s]."""


class CaptureThread:
    """Iterates a stream into a queue; the queue ends with the stream."""

    def __init__(
        self, stream: TrackerStream, queue: DroppingQueue[CapturedFrame], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._stream, self._queue, self._clock = stream, queue, clock
        self._thread = Thread(target=self._run, name="capture")
        self.frames = 0
        self.error: Exception | None = None
        """What ended the stream, if it was not its own end."""

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Close the stream and wait until its thread has ended; may be called again, and before `start`."""
        self._stream.close()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            for frame in self._stream:
                self.frames += 1
                self._queue.put(CapturedFrame(frame, self._clock()))
        except Exception as error:  # whoever waits for frames raises it again
            self.error = error
        finally:
            self._queue.end()
