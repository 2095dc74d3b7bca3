"""A recording that is started and stopped while a device runs."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

from harness.errors import BadInput, HarnessError
from harness.stream.codec.reader import WireFormat
from harness.stream.line_events import LineEvent
from harness.stream.recording.recording import RecordingWriter


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
            if self._wire is None:
                raise BadInput("No device is set up.", "Wait until records arrive.")
            writer = RecordingWriter(path, self._note)
            writer.on_configured(replace(self._wire, zeroed=False))  # the device's clock began earlier
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
