"""What all open trackers share: events, frames that wait, health, and an iteration that `close` ends."""

import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import Self

from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame
from harness.stream.host_clock import UnixTimeEstimator
from harness.stream.line_events import EventObserver, LineEvent, LineEventKind, NullLineObserver

_RATE_WINDOW_FRAMES = 50
"""Number of frames over which the present frame rate is computed."""
_TOGETHER_S = 1e-6
"""Frames of one read get times that differ by less than this [s]."""
_SHORTEST_RATE_WINDOW_S = 0.2
"""Shortest time over which it is computed [s]; USB adapters deliver frames in bursts 0.016 s apart."""


class DriverClosed(Exception):
    """Ends a wait when the driver is closed meanwhile."""


class OpenTracker(ABC):
    """An open tracker of any family: a `TrackerStream` with counts, and a context manager that closes itself.

    It has no thread: frames are read in the thread that iterates. `close` may be called from any thread.
    """

    _end_errors: tuple[type[Exception], ...] = (DriverClosed,)
    """Errors of `_step` that end an iteration quietly after `close`."""

    def __init__(
        self,
        port: str,
        *,
        observer: EventObserver | None = None,
        on_event: Callable[[LineEvent], None] = lambda event: None,
        monotonic_s: Callable[[], float] = time.monotonic,
        wall_s: Callable[[], float] = time.time,
    ) -> None:
        """`observer` and `on_event` receive the events, in the thread that iterates."""
        self.port = port
        self._events, self._on_event = observer or NullLineObserver(), on_event
        self._monotonic_s, self._now_wall_s = monotonic_s, wall_s
        self._wall_ahead_s = wall_s() - monotonic_s()
        self._closing = threading.Event()
        self._frames: deque[TrackerFrame] = deque()
        self._recent_s: deque[float] = deque(maxlen=_RATE_WINDOW_FRAMES)
        self._last_byte_s = monotonic_s()
        self._unix_times = UnixTimeEstimator(self.wall_s)

    @property
    @abstractmethod
    def stations(self) -> tuple[str, ...]:
        """Station names, in the order of the rows of a frame."""

    @property
    @abstractmethod
    def rate_hz(self) -> float:
        """Rounds of the stations per second [Hz], as configured or measured."""

    @property
    @abstractmethod
    def identification(self) -> str:
        """What the device is, in words."""

    @property
    @abstractmethod
    def station_list(self) -> str:
        """Stations of the device, with their names: `1 torso, 3 head`."""

    @property
    @abstractmethod
    def setup_note(self) -> str:
        """What a person at the device should know of its set-up, in one line."""

    @property
    @abstractmethod
    def counts(self) -> dict[str, int]:
        """Numbers of `reconnects`, `frames`, `records`, `out_of_range` and others so far."""

    def health(self) -> dict[str, float]:
        """Return the counts, the present frame rate [Hz] and the time since the last byte [s].

        `rate_hz` is absent until enough frames have arrived to tell it.
        """
        rate_hz = _arrival_rate_hz(list(self._recent_s))
        rate = {} if rate_hz is None else {"rate_hz": rate_hz}
        return {**self.counts, **rate, "silent_s": self._monotonic_s() - self._last_byte_s}

    def wall_s(self, received_s: float) -> float:
        """Convert a time on the host's monotonic clock to seconds since 1970."""
        return received_s + self._wall_ahead_s

    def measured_unix_s(self, frame: TrackerFrame) -> Floats:
        """(S,) time of measurement of each station since 1970 [s]; call it once for each frame, in order."""
        return self._unix_times(frame)

    def pause(self) -> None:  # noqa: B027  # the default does nothing: a line of bytes is started by the first read
        """Tell a tracker that streams already that frames are not needed before the iteration begins."""

    def __iter__(self) -> Iterator[TrackerFrame]:
        """Yield frames as they become complete, until the driver is closed.

        A new iteration continues where another ended.
        """
        while not self._closing.is_set():
            if self._frames:
                yield self._frames.popleft()
                continue
            try:
                self._step()
            except BaseException as error:
                if self._closing.is_set() and isinstance(error, self._end_errors):
                    return
                self.close()
                raise

    @abstractmethod
    def close(self) -> None:
        """Release the tracker and end every iteration. May be called from any thread, and more than once."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @abstractmethod
    def _step(self) -> None:
        """Wait once for data and process it."""

    def _add_frames(self, frames: Sequence[TrackerFrame], now_s: float) -> None:
        self._frames.extend(frames)
        self._recent_s.extend(frame.received_s for frame in frames)

    def _report(self, kind: LineEventKind, text: str) -> None:
        """Send an event to the observer and the callback."""
        event = LineEvent(kind, self._monotonic_s(), self._now_wall_s(), text)
        self._events.on_event(event)
        self._on_event(event)


def _arrival_rate_hz(received_s: list[float]) -> float | None:
    """Frames per second of frames received at these times [s]; None for too short a time.

    Frames that arrived together with the first are left out: nothing tells how long they waited.
    """
    later = sum(1 for at_s in received_s if at_s - received_s[0] > _TOGETHER_S)
    span_s = received_s[-1] - received_s[0] if received_s else 0.0
    return later / span_s if span_s >= _SHORTEST_RATE_WINDOW_S else None
