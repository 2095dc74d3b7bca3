"""Opens the tracker at a port, whatever its family: the port's name tells which it is."""

from collections.abc import Callable

from harness.stream.fastrak.driver import Fastrak, FastrakConfig
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import open_tracker
from harness.stream.line_events import LineEvent, LineObserver
from harness.stream.polhemus.driver.tracker import Tracker

TrackerConfig = DriverConfig | FastrakConfig
"""Settings of a tracker of any family."""


def open_tracker_at(
    port: str,
    config: TrackerConfig,
    *,
    observer: LineObserver | None = None,
    on_event: Callable[[LineEvent], None] = lambda event: None,
) -> Tracker:
    """Open and set up the tracker at a port: `fastrak:/dev/ttyUSB0`, or the line of an IS-900. Raises BadInput."""
    if isinstance(config, FastrakConfig):
        return Fastrak(port, config, observer=observer, on_event=on_event)
    return open_tracker(port, config, observer=observer, on_event=on_event)
