"""Recording of a device until told to stop."""

import threading
from collections.abc import Callable
from contextlib import suppress

from harness.stream.codec.blocks import RECEIVED
from harness.stream.driver import DriverConfig, LineEvent, Tracker, open_tracker
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
) -> None:
    """Let a device stream until Ctrl-C, or for `seconds`, and record everything that passes over its line.

    `log` receives the messages that deserve a line of their own, `progress` the text of the progress line. Raises
    BadInput when there is no device, and BadFile when the recording cannot be written; blocks written before are kept.
    """

    def report_event(event: LineEvent) -> None:
        log(event.text)

    with suppress(KeyboardInterrupt), open_tracker(port, config, observer=writer, on_event=report_event) as device:
        names = ", ".join(f"{number} {name}" for number, name in enumerate(device.stations, 1))
        log(f"{device.identification or 'a device'} at {port}; stations {names}; Ctrl-C ends the recording")
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


def _progress_text(device: Tracker, frame: TrackerFrame, writer: RecordingWriter) -> str:
    health = device.health()
    tracked = int((frame.position_valid | frame.orientation_valid).sum())
    return (
        f"{health['frames']:.0f} frames, {health['rate_hz']:.1f} Hz, {tracked} of {len(device.stations)} stations "
        f"tracked, {1e-3 * writer.counts[RECEIVED]:.0f} kB"
    )
