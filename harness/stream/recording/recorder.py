"""Records a device until told to stop."""

import threading
from collections.abc import Callable
from contextlib import suppress

from harness.stream.codec.blocks import RECEIVED
from harness.stream.driver import DriverConfig, Is900, LineEvent
from harness.stream.frame import TrackerFrame
from harness.stream.recording.recording import RecordingWriter

PROGRESS_INTERVAL_S = 1.0
"""Progress is told so often [s]."""


def record_port(
    port: str,
    wanted: DriverConfig,
    into: RecordingWriter,
    *,
    seconds: float | None = None,
    say: Callable[[str], None] = lambda line: None,
    progress: Callable[[str], None] = lambda line: None,
) -> None:
    """Let a device stream until Ctrl-C, or for so long, and write all that goes over its line.

    `say` hears what is worth a line of its own, `progress` how it goes. BadInput when there is no device, BadFile when
    the recording cannot be written; what had come until then is kept.
    """

    def happened(event: LineEvent) -> None:
        say(event.text)

    with suppress(KeyboardInterrupt), Is900(port, wanted, witness=into, on_event=happened) as device:
        names = ", ".join(f"{number} {name}" for number, name in enumerate(device.stations, 1))
        say(f"{device.identification or 'a device'} at {port}; stations {names}; Ctrl-C ends the recording")
        end = threading.Timer(seconds or 0.0, device.close)
        if seconds is not None:
            end.start()
        try:
            told_s = -PROGRESS_INTERVAL_S
            for frame in device:
                if frame.received_s - told_s >= PROGRESS_INTERVAL_S:
                    told_s = frame.received_s
                    progress(_progress_text(device, frame, into))
        finally:
            end.cancel()
            progress("")


def _progress_text(device: Is900, frame: TrackerFrame, into: RecordingWriter) -> str:
    health = device.health()
    tracked = int((frame.position_valid | frame.orientation_valid).sum())
    return (
        f"{health['frames']:.0f} frames, {health['rate_hz']:.1f} Hz, {tracked} of {len(device.stations)} stations "
        f"tracked, {1e-3 * into.counts[RECEIVED]:.0f} kB"
    )
