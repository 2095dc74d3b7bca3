"""Driver of a real IS-900 on a serial port, TCP or UDP, as a `TrackerStream` (docs/device.md, Driver)."""
