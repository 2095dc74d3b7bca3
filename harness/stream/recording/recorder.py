"""Recording of a device until told to stop."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from harness.stream.codec.blocks import RECEIVED
from harness.stream.driver import DriverConfig, Tracker, open_tracker
from harness.stream.event_counter import EventCounter
from harness.stream.frame import TrackerFrame
from harness.stream.recording.recording import RecordingWriter

PROGRESS_INTERVAL_S = 1.0
"""Interval between two progress reports [s]."""


def record_port(
    port: str,
    config: DriverConfig,
    writer: RecordingWriter,
    *,
    seconds: float | None = None,
    log: Callable[[str], None] = lambda line: None,
    progress: Callable[[str], None] = lambda line: None,
) -> dict[str, int]:
    """Let a device stream until Ctrl-C, or for `seconds`, and record everything that passes over its line.

    `log` receives the messages that deserve a line of their own, `progress` the text of the progress line. Returns the
    counts of the driver, and 1 as `interrupted` if a signal ended it; there are none before the device was set up.
    Raises BadInput when there is no device, and BadFile when the recording cannot be written; blocks written before are
    kept.
    """

    counts: dict[str, int] = {}
    events = EventCounter(log)
    with _count_interrupt(counts), open_tracker(port, config, observer=writer, on_event=events) as device:
        name = device.identification or "a device"
        log(f"{name} at {port}; stations {device.station_list}; Ctrl-C ends the recording")
        log(device.setup_note)
        end = threading.Timer(seconds or 0.0, device.close)
        if seconds is not None:
            end.start()
        try:
            reported_s = -PROGRESS_INTERVAL_S
            for frame in device:
                if frame.received_s - reported_s >= PROGRESS_INTERVAL_S:
                    reported_s = frame.received_s
                    progress(_progress_text(device, frame, writer))
        finally:
            end.cancel()
            progress("")
            counts |= device.counts
    return counts


@contextmanager
def _count_interrupt(counts: dict[str, int]) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        counts["interrupted"] = 1


def _progress_text(device: Tracker, frame: TrackerFrame, writer: RecordingWriter) -> str:
    health = device.health()
    beyond = f", {health['out_of_range']:.0f} positions out of range" if health["out_of_range"] else ""
    tracked = int((frame.position_valid | frame.orientation_valid).sum())
    rate = f", {health['rate_hz']:.1f} Hz" if "rate_hz" in health else ""
    return (
        f"{health['frames']:.0f} frames{rate}, {tracked} of {len(device.stations)} stations "
        f"tracked{beyond}, {1e-3 * writer.counts[RECEIVED]:.0f} kB"
    )
