"""Recording of a device until told to stop, or between two moments of a session."""

import math
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

from harness.errors import BadInput, HarnessError
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import EventCounter, LineEvent, TrackedBodies
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.ports import TrackerConfig, open_tracker_at
from harness.stream.recording.blocks import POSES, RECEIVED
from harness.stream.recording.pose_writer import PoseRecordingWriter
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.tracker import OpenTracker


class RecordingSwitch:
    """A `LineObserver` that records between `start` and `stop`, and ignores everything else.

    A recording begins with the device's present configuration, so that it can be replayed alone. An error while writing
    ends the recording, and never the session; `failure` has it.
    """

    def __init__(self, note: Mapping[str, Any] | None = None) -> None:
        """`note` describes the origin of the recordings."""
        self.failure = ""
        self._note = dict(note or {})
        self._wire: WireFormat | None = None
        self._bodies: TrackedBodies | None = None
        self._writer: RecordingWriter | None = None
        self._lock = Lock()

    @property
    def path(self) -> Path | None:
        """The file that is being recorded into; None if there is none."""
        writer = self._writer
        return None if writer is None else writer.path

    def start(self, path: Path) -> None:
        """Begin a recording. BadInput while another one runs, or before a device was set up; BadFile for the file."""
        with self._lock:
            if self._writer is not None:
                raise BadInput(f"A recording into {self._writer.path} runs.", "Stop it first.")
            writer: RecordingWriter
            if self._bodies is not None:
                writer = PoseRecordingWriter(path, self._note)
                writer.on_bodies(self._bodies)
            elif self._wire is not None:
                writer = RecordingWriter(path, self._note)
                writer.on_configured(replace(self._wire, zeroed=False))  # the device's clock began earlier
            else:
                raise BadInput("No device is set up.", "Wait until records arrive.")
            self._writer, self.failure = writer, ""

    def stop(self) -> Path:
        """End the recording; returns its file. BadInput if none runs."""
        with self._lock:
            if self._writer is None:
                raise BadInput("No recording runs.", "Start one first.")
            writer, self._writer = self._writer, None
            writer.close()
            return writer.path

    def close(self) -> None:
        """End the recording if one runs."""
        if self._writer is not None:
            self.stop()

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        self._write("on_received", data, monotonic_s, wall_s)

    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        self._write("on_sent", data, monotonic_s, wall_s)

    def on_configured(self, wire: WireFormat) -> None:
        with self._lock:
            self._wire = wire
        self._write("on_configured", wire)

    def on_bodies(self, bodies: TrackedBodies) -> None:
        with self._lock:
            self._bodies = bodies

    def on_frame(self, frame: TrackerFrame) -> None:
        self._write("on_frame", frame)

    def on_event(self, event: LineEvent) -> None:
        self._write("on_event", event)

    def _write(self, method: str, *content: Any) -> None:
        if self._writer is None:  # without the lock: the usual case costs nothing
            return
        with self._lock:
            if self._writer is None:
                return
            try:
                getattr(self._writer, method)(*content)
            except HarnessError as error:
                self.failure = str(error)
                writer, self._writer = self._writer, None
                writer.close()


PROGRESS_INTERVAL_S = 1.0
"""Interval between two progress reports [s]."""


def record_port(
    port: str,
    config: TrackerConfig,
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
    with _count_interrupt(counts), open_tracker_at(port, config, observer=writer, on_event=events) as device:
        log(f"{device.identification} at {port}; stations {device.station_list}; Ctrl-C ends the recording")
        log(device.setup_note)
        end = threading.Timer(seconds or 0.0, device.close)
        if seconds is not None:
            end.start()
        try:
            reported_s, until_s = -PROGRESS_INTERVAL_S, math.inf
            for frame in device:
                if seconds is not None:  # a VRPN server is heard for a second before the stream begins
                    until_s = min(until_s, frame.received_s + seconds)
                if frame.received_s >= until_s:
                    break
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


def _progress_text(device: OpenTracker, frame: TrackerFrame, writer: RecordingWriter) -> str:
    health = device.health()
    beyond = f", {health['out_of_range']:.0f} positions out of range" if health["out_of_range"] else ""
    rate = f", {health['rate_hz']:.1f} Hz" if "rate_hz" in health else ""
    written = f"{1e-3 * writer.counts[RECEIVED]:.0f} kB"
    if POSES in writer.counts:
        written = f"{writer.counts[POSES]} poses"
    return f"{health['frames']:.0f} frames{rate}, {tracked_text(frame)}{beyond}, {written}"


def tracked_text(frame: TrackerFrame) -> str:
    """How many stations are tracked: `3 of 4 stations tracked`."""
    tracked = int((frame.position_valid | frame.orientation_valid).sum())
    return f"{tracked} of {len(frame.quality)} stations tracked"
