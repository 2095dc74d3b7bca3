"""The capture thread, which only reads the tracker, and the queue to the solving thread: no byte waits for a pose."""

from queue import Empty, SimpleQueue
from threading import Thread
from typing import Generic, TypeVar

from harness.stream import TrackerFrame, TrackerStream

T = TypeVar("T")


class DroppingQueue(Generic[T]):
    """A bounded queue for one producer and one consumer thread; a full queue drops and counts its oldest item."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.dropped = 0
        self._items: SimpleQueue[T | None] = SimpleQueue()

    def __len__(self) -> int:
        return self._items.qsize()

    def put(self, item: T) -> None:
        """Add an item; never blocks."""
        if self._items.qsize() >= self.size:
            try:
                self._items.get_nowait()
                self.dropped += 1
            except Empty:  # the consumer took it meanwhile
                pass
        self._items.put(item)

    def take(self) -> T | None:
        """Remove and return the oldest item, waiting for one; None after the end."""
        item = self._items.get()
        if item is None:
            self._items.put(None)  # for the next call
        return item

    def end(self) -> None:
        """Mark the end; items in the queue can still be taken."""
        self._items.put(None)


class CaptureThread:
    """Moves frames from a stream to a queue; the queue ends when the stream ends."""

    def __init__(self, stream: TrackerStream, queue: DroppingQueue[TrackerFrame]) -> None:
        self._stream, self._queue = stream, queue
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
                self._queue.put(frame)
        except Exception as error:  # `run_session` raises it again
            self.error = error
        finally:
            self._queue.end()
