"""What all drivers of a tracker share: events, frames that wait, health, and an iteration that `close` ends."""

import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import ClassVar, Self

from harness.stream.frame import TrackerFrame
from harness.stream.line_events import LineEvent, LineEventKind, LineObserver, NullLineObserver
from harness.stream.polhemus.codec.reader import ContinuousFrameReader, WireFormat
from harness.stream.polhemus.driver.config import DriverTiming, LineConfig
from harness.stream.polhemus.driver.connection import DeviceConnection, DriverClosed, Host
from harness.stream.polhemus.driver.transport import LineLost, Transport

_RATE_WINDOW_FRAMES = 50
"""Number of frames over which the present frame rate is computed."""
_TOGETHER_S = 1e-6
"""Frames of one read get times that differ by less than this [s]."""
_SHORTEST_RATE_WINDOW_S = 0.2
"""Shortest time over which it is computed [s]; USB adapters deliver frames in bursts 0.016 s apart."""


class Tracker(ABC):
    """An open tracker: a `TrackerStream` with a wire format and counts, and a context manager that closes itself.

    It has no thread: frames are read in the thread that iterates. `close` may be called from any thread.
    """

    _line: DeviceConnection
    _wire: WireFormat
    _config_type: ClassVar[type[LineConfig]]
    """Type of the configuration; its defaults serve where none is given."""
    _reconnects = 0

    def __init__(
        self,
        port: str,
        config: LineConfig | None = None,
        *,
        observer: LineObserver | None = None,
        on_event: Callable[[LineEvent], None] = lambda event: None,
        timing: DriverTiming | None = None,
        host: Host | None = None,
    ) -> None:
        """Open and set up the tracker.

        `observer` receives all bytes and events, `on_event` the events only. Both are called in the thread that
        iterates.
        """
        self.port, self.config = port, config or self._config_type()
        self._timing, self._host = timing or DriverTiming(), host or Host()
        self._observer, self._on_event = observer or NullLineObserver(), on_event
        self._wall_ahead_s = self._host.wall_s() - self._host.monotonic_s()
        self._reader, self._closing = ContinuousFrameReader(), threading.Event()
        self._frames: deque[TrackerFrame] = deque()
        self._recent_s: deque[float] = deque(maxlen=_RATE_WINDOW_FRAMES)
        self._last_byte_s = self._host.monotonic_s()
        self._streaming = False
        self._open()

    @property
    def stations(self) -> tuple[str, ...]:
        """Station names, in the order of the device's stations."""
        return self._wire.stations

    @property
    def wire(self) -> WireFormat:
        """Content of the records, by the latest configuration."""
        return self._wire

    @property
    @abstractmethod
    def identification(self) -> str:
        """Name that the device reports, if any."""

    @property
    def station_list(self) -> str:
        """Characters of the device's stations, with their names: `1 torso, 3 head`."""
        return ", ".join(f"{c} {name}" for c, name in zip(self._wire.characters.decode(), self.stations, strict=True))

    @property
    @abstractmethod
    def setup_note(self) -> str:
        """What a person at the device should know of its set-up, in one line."""

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of `sessions`, `reconnects`, `frames`, `records`, `garbage_bytes` and `clock_resets` so far."""
        return self._reader.counts | {"reconnects": self._reconnects}

    def health(self) -> dict[str, float]:
        """Return the counts, the present frame rate [Hz] and the time since the last byte [s].

        `rate_hz` is absent until enough frames have arrived to tell it.
        """
        rate_hz = _arrival_rate_hz(list(self._recent_s))
        rate = {} if rate_hz is None else {"rate_hz": rate_hz}
        return {**self.counts, **rate, "silent_s": self._host.monotonic_s() - self._last_byte_s}

    def wall_s(self, received_s: float) -> float:
        """Convert a time on the host's monotonic clock to seconds since 1970."""
        return received_s + self._wall_ahead_s

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
                if self._closing.is_set() and isinstance(error, DriverClosed | LineLost):
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
    def _open(self) -> None:
        """Open the port and set up the tracker; `_line` and `_wire` are set afterwards. Raises BadInput."""

    @abstractmethod
    def _step(self) -> None:
        """Wait once for bytes and process them."""

    def _connect_line(self, transport: Transport, observer: LineObserver) -> DeviceConnection:
        line = DeviceConnection(transport, self._host, observer, self._timing)
        line.closing, line.on_data = self._closing.is_set, self._on_data
        return line

    def _receive(self) -> tuple[bool, float]:
        """Wait once for bytes; return whether any came, and the time [s]. Without any, an overdue frame is closed."""
        received = self._line.receive(self._timing.poll_s)
        now_s = self._host.monotonic_s()
        if not received:  # the wait exceeds the delay of USB adapters, so that late bytes do not split a frame
            overdue = self._reader.expire(now_s)
            if overdue:
                self._observer.on_received(b"", now_s, self._host.wall_s())
            self._add_frames(overdue, now_s)
        return bool(received), now_s

    def _on_data(self, data: bytes, now_s: float) -> None:
        self._last_byte_s = now_s
        self._add_frames(self._reader.feed(data, now_s), now_s)

    def _add_frames(self, frames: Sequence[TrackerFrame], now_s: float) -> None:
        self._frames.extend(frames)
        self._recent_s.extend(frame.received_s for frame in frames)

    def _report(self, kind: LineEventKind, text: str) -> None:
        """Send an event to the observer and the callback."""
        event = LineEvent(kind, self._host.monotonic_s(), self._host.wall_s(), text)
        self._observer.on_event(event)
        self._on_event(event)


def _arrival_rate_hz(received_s: list[float]) -> float | None:
    """Frames per second of frames received at these times [s]; None for too short a time.

    Frames that arrived together with the first are left out: nothing tells how long they waited.
    """
    later = sum(1 for at_s in received_s if at_s - received_s[0] > _TOGETHER_S)
    span_s = received_s[-1] - received_s[0] if received_s else 0.0
    return later / span_s if span_s >= _SHORTEST_RATE_WINDOW_S else None
