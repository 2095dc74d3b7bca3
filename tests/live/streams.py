"""Tracker streams for tests."""

import threading
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace

from harness.stream import TrackerFrame


class Paced:
    """A `TrackerStream` of given frames, stamped on delivery; it then waits for `close`, or ends."""

    def __init__(
        self,
        frames: Iterable[TrackerFrame],
        period_s: float = 0.0,
        *,
        ends: bool = True,
        stations: tuple[str, ...] = ("a", "b"),
    ) -> None:
        self.stations = stations
        self._frames, self._period_s, self._ends = frames, period_s, ends
        self.closed = threading.Event()

    def __iter__(self) -> Iterator[TrackerFrame]:
        for frame in self._frames:
            if self.closed.wait(self._period_s):
                return
            yield replace(frame, received_s=time.monotonic())
        if not self._ends:
            self.closed.wait()

    def close(self) -> None:
        self.closed.set()


class Broken(Paced):
    """A stream that raises an error after its frames."""

    def __iter__(self) -> Iterator[TrackerFrame]:
        yield from super().__iter__()
        raise ArithmeticError("the stream broke")
