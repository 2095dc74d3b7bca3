"""Opens the tracker at a port, whatever its family: the port's name and the settings tell which it is."""

from collections.abc import Callable

from harness.stream.fastrak import Fastrak, FastrakConfig
from harness.stream.is900 import DriverConfig, open_tracker
from harness.stream.line_events import LineEvent, LineObserver
from harness.stream.tracker import OpenTracker
from harness.stream.vrpn import VrpnConfig, VrpnTracker

TrackerConfig = DriverConfig | FastrakConfig | VrpnConfig
"""Settings of a tracker of any family."""


def open_tracker_at(
    port: str,
    config: TrackerConfig,
    *,
    observer: LineObserver | None = None,
    on_event: Callable[[LineEvent], None] = lambda event: None,
) -> OpenTracker:
    """Open and set up a tracker: `vrpn:Tracker0@host`, `fastrak:/dev/ttyUSB0`, or an IS-900. Raises BadInput."""
    if isinstance(config, VrpnConfig):
        return VrpnTracker(port, config, observer=observer, on_event=on_event)
    if isinstance(config, FastrakConfig):
        return Fastrak(port, config, observer=observer, on_event=on_event)
    return open_tracker(port, config, observer=observer, on_event=on_event)
