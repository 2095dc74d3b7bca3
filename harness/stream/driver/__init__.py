"""A real IS-900 on a serial port or a TCP connection, as a `TrackerStream` (docs/device.md, Driver)."""

from harness.stream.driver.events import LineEvent, Witness
from harness.stream.driver.is900 import Is900
from harness.stream.driver.wanted import Timing, Wanted

__all__ = ["Is900", "LineEvent", "Timing", "Wanted", "Witness"]
