"""A queue between a fast and a slower thread that drops its oldest items, so that putting never blocks."""

from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

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

    def drop_all(self) -> None:
        """Drop and count all items in the queue; called by the consumer."""
        for _ in range(len(self)):
            if self._items.get() is None:
                self.end()
            else:
                self.dropped += 1

    def end(self) -> None:
        """Mark the end; items in the queue can still be taken."""
        self._items.put(None)
