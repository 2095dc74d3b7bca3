"""What drivers of a line share: its bytes, their reader, and the wire format."""

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar

from harness.stream.line_events import LineEvent, LineObserver, NullLineObserver
from harness.stream.polhemus.codec.reader import ContinuousFrameReader, WireFormat
from harness.stream.polhemus.driver.config import DriverTiming, LineConfig
from harness.stream.polhemus.driver.connection import DeviceConnection, Host
from harness.stream.polhemus.driver.transport import LineLost, Transport
from harness.stream.tracker import DriverClosed, OpenTracker


class Tracker(OpenTracker):
    """An open tracker on a line, or one that broadcasts."""

    _line: DeviceConnection
    _wire: WireFormat
    _config_type: ClassVar[type[LineConfig]]
    """Type of the configuration; its defaults serve where none is given."""
    _reconnects = 0
    _end_errors = (DriverClosed, LineLost)

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
        self.config = config or self._config_type()
        self._timing, self._host = timing or DriverTiming(), host or Host()
        self._observer = observer or NullLineObserver()
        clocks = {"monotonic_s": self._host.monotonic_s, "wall_s": self._host.wall_s}
        super().__init__(port, observer=self._observer, on_event=on_event, **clocks)
        self._reader = ContinuousFrameReader()
        self._streaming = False
        self._open()

    @property
    def stations(self) -> tuple[str, ...]:
        return self._wire.stations

    @property
    def rate_hz(self) -> float:
        return self._wire.rate_hz

    @property
    def wire(self) -> WireFormat:
        """Content of the records, by the latest configuration."""
        return self._wire

    @property
    def station_list(self) -> str:
        return ", ".join(f"{c} {name}" for c, name in zip(self._wire.characters.decode(), self.stations, strict=True))

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of `sessions`, `reconnects`, `frames`, `records`, `garbage_bytes` and `clock_resets` so far."""
        return self._reader.counts | {"reconnects": self._reconnects}

    @abstractmethod
    def _open(self) -> None:
        """Open the port and set up the tracker; `_line` and `_wire` are set afterwards. Raises BadInput."""

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
