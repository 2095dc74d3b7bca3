"""Opening of a tracker by its port: a serial line or TCP, which takes commands, or UDP packets, which do not."""

from collections.abc import Callable
from types import TracebackType
from typing import Protocol

from harness.stream.codec.reader import WireFormat
from harness.stream.driver.broadcast import Is900Broadcast
from harness.stream.driver.config import DriverConfig
from harness.stream.driver.is900 import Is900
from harness.stream.driver.transport import UDP_SCHEME
from harness.stream.frame import TrackerStream
from harness.stream.line_events import LineEvent, LineObserver


class Tracker(TrackerStream, Protocol):
    """Interface of an open tracker, of whichever kind: a stream with a format and counts that closes itself."""

    @property
    def wire(self) -> WireFormat:
        """Content of the records."""
        ...

    @property
    def identification(self) -> str:
        """Name that the device reports, if any."""
        ...

    @property
    def station_list(self) -> str:
        """Characters of the device's stations, with their names."""
        ...

    @property
    def setup_note(self) -> str:
        """What a person at the device should know of its set-up, in one line."""
        ...

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of sessions, reconnections, frames, records, bytes of garbage and clock resets so far."""
        ...

    def health(self) -> dict[str, float]:
        """Return the counts, the present frame rate [Hz] and the time since the last byte [s]."""
        ...

    def wall_s(self, received_s: float) -> float:
        """Convert a time on the host's monotonic clock to seconds since 1970."""
        ...

    def __enter__(self) -> "Tracker": ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def open_tracker(
    port: str,
    config: DriverConfig | None = None,
    *,
    observer: LineObserver | None = None,
    on_event: Callable[[LineEvent], None] = lambda event: None,
) -> Tracker:
    """Open and set up a tracker; `udp://host:port` listens to a broadcast. Raises BadInput."""
    if port.startswith(UDP_SCHEME):
        return Is900Broadcast(port, config, observer=observer, on_event=on_event)
    return Is900(port, config, observer=observer, on_event=on_event)
