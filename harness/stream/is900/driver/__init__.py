"""Driver of a real IS-900 on a serial port, TCP or UDP, as a `TrackerStream` (docs/device.md, Driver)."""

from harness.stream.is900.driver.broadcast import Is900Broadcast
from harness.stream.is900.driver.config import DriverConfig, DriverTiming
from harness.stream.is900.driver.is900 import Is900, open_tracker
from harness.stream.is900.driver.tracker import Tracker
from harness.stream.line_events import LineEvent, LineObserver

__all__ = [
    "DriverConfig",
    "DriverTiming",
    "Is900",
    "Is900Broadcast",
    "LineEvent",
    "LineObserver",
    "Tracker",
    "open_tracker",
]
