"""Opening of a tracker by its port: a serial line or TCP, which takes commands, or UDP packets, which do not."""

from collections.abc import Callable

from harness.stream.driver.broadcast import Is900Broadcast
from harness.stream.driver.config import DriverConfig
from harness.stream.driver.is900 import Is900
from harness.stream.driver.transport import UDP_SCHEME
from harness.stream.line_events import LineEvent, LineObserver

Tracker = Is900 | Is900Broadcast
"""An open tracker: a `TrackerStream` with a wire format, counts and health."""


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
