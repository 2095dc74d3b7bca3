"""Driver of a real IS-900 on a serial port or a TCP connection, as a `TrackerStream` (docs/device.md, Driver)."""

from harness.stream.driver.config import DriverConfig, DriverTiming
from harness.stream.driver.is900 import Is900
from harness.stream.line_events import LineEvent, LineObserver

__all__ = ["DriverConfig", "DriverTiming", "Is900", "LineEvent", "LineObserver"]
