"""Hands what one thread has to another, which may be slower: the newest counts, and whoever puts never waits."""

from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

T = TypeVar("T")


class DroppingQueue(Generic[T]):
    """A bounded queue of one putting and one taking thread; when it is full the oldest gives way and is counted."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.dropped = 0
        self._waiting: SimpleQueue[T | None] = SimpleQueue()

    def __len__(self) -> int:
        return self._waiting.qsize()

    def put(self, item: T) -> None:
        """Add the newest."""
        if self._waiting.qsize() >= self.size:
            try:
                self._waiting.get_nowait()
                self.dropped += 1
            except Empty:  # the other thread took it this very moment
                pass
        self._waiting.put(item)

    def take(self) -> T | None:
        """The oldest that waits, or the next to come; None when nothing will come any more."""
        item = self._waiting.get()
        if item is None:
            self._waiting.put(None)  # for whoever asks again
        return item

    def drop_all(self) -> None:
        """Let go of all that waits and count it, for the taking thread to start afresh."""
        for _ in range(len(self)):
            if self._waiting.get() is None:
                self.end()
            else:
                self.dropped += 1

    def end(self) -> None:
        """Nothing comes any more; what waits can still be taken."""
        self._waiting.put(None)
