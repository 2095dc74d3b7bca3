"""Recordings: all that went over the line, both ways, with the host's times; the layout is that of `read_blocks.py`.

A recording only ever grows, by whole blocks. What a crash cut off at the end, or a disk spoilt in the middle, costs
the blocks it touches and is named; recording into a file of ours goes on behind it. Blocks by kind:

    recv, sent   bytes from and to the device; of no bytes: nothing was there, and a frame was given up waiting for
    conf         JSON of the `WireFormat` that the bytes after it are read with; the device's clock starts anew
    evnt         JSON of what befell the line, as the driver reported it
    note         JSON of what made what follows: the port, or the scenario, clip, seed, stations and rate
"""

import json
import math
import os
import stat
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import Any

from harness.core.fields import build
from harness.errors import BadFile, HarnessError
from harness.stream.codec.blocks import (
    CONFIGURED,
    EVENT,
    FILE_HEADER,
    MAX_PAYLOAD_BYTES,
    NOTE,
    RECEIVED,
    SENT,
    VERSION,
    DamagedSpan,
    RecordingBlock,
    encode_block,
    read_blocks,
    read_version,
)
from harness.stream.codec.capture import ByteCapture
from harness.stream.codec.reader import WireFormat
from harness.stream.line_events import LineEvent

EXPECTED_FILE = "a recording by `harness record`"


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording as it was when it was read."""

    path: Path
    data: bytes

    def blocks(self) -> Iterator[RecordingBlock]:
        """Every whole block, in the order of the file."""
        return (entry for entry in self._entries() if isinstance(entry, RecordingBlock))

    @cached_property
    def damage(self) -> tuple[str, ...]:
        """What is cut off or damaged, a line each, in the order of the file."""
        out: list[str] = []
        spoilt: DamagedSpan | None = None
        before_s = None
        for entry in self._entries():
            if isinstance(entry, DamagedSpan):
                spoilt = entry
                continue
            if spoilt:
                out.append(_damage_text(spoilt, before_s, entry.monotonic_s))
            spoilt, before_s = None, entry.monotonic_s
        if spoilt:
            out.append(_truncation_text(spoilt, before_s))
        return tuple(out)

    @cached_property
    def formats(self) -> tuple[WireFormat, ...]:
        """How it was read, each time the device was set up; BadFile when one cannot be made out."""
        return tuple(self.format_of(block) for block in self.blocks() if block.kind == CONFIGURED)

    @cached_property
    def note(self) -> dict[str, Any]:
        """The last word on what made it; empty when nothing is said."""
        notes = [block for block in self.blocks() if block.kind == NOTE]
        return self._json(notes[-1]) if notes else {}

    @property
    def events(self) -> list[dict[str, Any]]:
        """What befell the line: kind, text and when, by the host's clock [s]."""
        happened = [block for block in self.blocks() if block.kind == EVENT]
        return [{"monotonic_s": block.monotonic_s, **self._json(block)} for block in happened]

    def format_of(self, configured: RecordingBlock) -> WireFormat:
        """The wire format in a block of that kind; BadFile."""
        content = self._json(configured)
        try:
            content["characters"] = str(content.get("characters", "")).encode()
            wire = build(WireFormat, content, "wire format")
            if wire.rate_hz <= 0.0:
                raise TypeError(f"wire format.rate_hz: {wire.rate_hz:g} is not positive")
            return wire
        except (TypeError, HarnessError) as error:
            raise BadFile(self.path, f"a wire format that cannot be used ({error})", EXPECTED_FILE, "") from error

    def _json(self, block: RecordingBlock) -> dict[str, Any]:
        try:
            content = json.loads(block.payload)
        except ValueError as error:
            raise BadFile(self.path, f"a {block.kind} block that is no JSON", EXPECTED_FILE, "") from error
        return content if isinstance(content, dict) else {}

    def _entries(self) -> Iterator[RecordingBlock | DamagedSpan]:
        return read_blocks(self.data, len(FILE_HEADER) if read_version(self.data) else 0)


def read_recording(path: Path | str) -> Recording:
    """What a file holds, whatever was cut off or damaged; BadFile for no recording, or one of a newer version."""
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise _file_error(path, error) from error
    if not data:
        raise BadFile(path, "an empty file", EXPECTED_FILE, "Nothing was recorded into it.")
    _check_kind(path, data)
    return Recording(path, data)


def _check_kind(path: Path, data: bytes) -> None:
    """BadFile unless the file is ours, as far as it goes."""
    version = read_version(data)
    if version is not None and version > VERSION:
        found = f"a recording of version {version}"
        raise BadFile(path, found, f"version {VERSION} at most", "A newer version of the harness made it; use that.")
    if (
        version is None
        and not FILE_HEADER.startswith(data)
        and all(isinstance(entry, DamagedSpan) for entry in read_blocks(data, 0))
    ):
        raise BadFile(path, "no recording", EXPECTED_FILE, "Is it the right file? Nothing was changed in it.")


class RecordingWriter:
    """Appends to a recording; a `Witness` of the driver. Blocks go to the system as they come: a process that dies
    loses none that was finished.

    The file is looked at when this is made and touched when there is something to write. BadFile for one that is not
    ours, that another process is recording into, or that cannot be written.
    """

    def __init__(self, path: Path | str, note: Mapping[str, Any] | None = None) -> None:
        """`note` says what makes the recording."""
        self.path = Path(path)
        self.counts = dict.fromkeys((RECEIVED, SENT, CONFIGURED, EVENT), 0)
        """Bytes received and sent, and how often it was set up and something happened, by kind."""
        self._note = dict(note or {})
        before = self._what_is_there()
        self._new = before is None
        self._stations = before.formats[-1].stations if before and before.formats else None
        self._file: int | None = None
        self._closed = False
        self._lock = Lock()
        """The thread that reads and the one that closes both write."""

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        self._append_all(RECEIVED, data, monotonic_s, wall_s)

    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        self._append_all(SENT, data, monotonic_s, wall_s)

    def on_configured(self, wire: WireFormat, monotonic_s: float | None = None, wall_s: float | None = None) -> None:
        """BadFile for other stations than the recording has had: a stream's never change."""
        if self._stations not in (None, wire.stations):
            raise BadFile(
                self.path,
                f"a recording of the stations {', '.join(self._stations or ())}",
                f"one of {', '.join(wire.stations)}",
                "Record other stations into another file.",
            )
        self._stations = wire.stations
        content = asdict(wire) | {"characters": wire.characters.decode("latin-1")}
        self._append_json(CONFIGURED, content, monotonic_s, wall_s)
        self.counts[CONFIGURED] += 1

    def on_event(self, event: LineEvent) -> None:
        self._append_json(EVENT, {"kind": event.kind, "text": event.text}, event.monotonic_s, event.wall_s)
        self.counts[EVENT] += 1

    def close(self) -> None:
        """Have it all on the disk; may be done twice. A new file in which no device was ever set up is removed: nothing
        could be made of it."""
        with self._lock:
            self._closed = True
            if self._file is not None:
                os.fsync(self._file)
                os.close(self._file)
                self._file = None
                if self._new and not self.counts[CONFIGURED]:
                    self.path.unlink(missing_ok=True)

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def _append_all(self, kind: str, data: bytes, monotonic_s: float, wall_s: float) -> None:
        for begin in range(0, max(len(data), 1), MAX_PAYLOAD_BYTES):
            self._append(RecordingBlock(kind, monotonic_s, wall_s, data[begin : begin + MAX_PAYLOAD_BYTES]))
        self.counts[kind] += len(data)

    def _append_json(
        self, kind: str, content: Mapping[str, Any], monotonic_s: float | None = None, wall_s: float | None = None
    ) -> None:
        now_s = time.monotonic() if monotonic_s is None else monotonic_s
        then_s = time.time() if wall_s is None else wall_s
        self._append(RecordingBlock(kind, now_s, then_s, json.dumps(content, default=str).encode()))

    def _append(self, block: RecordingBlock) -> None:
        with self._lock:
            if self._closed:
                return
            try:
                if self._file is None:
                    self._file = self._opened()
                    note = RecordingBlock(
                        NOTE, block.monotonic_s, block.wall_s, json.dumps(self._note, default=str).encode()
                    )
                    _write_all(self._file, encode_block(note))
                _write_all(self._file, encode_block(block))
            except OSError as error:
                raise _file_error(self.path, error) from error

    def _opened(self) -> int:
        """The file, ours alone, with its header whole."""
        new = os.O_CREAT | os.O_EXCL if self._new else 0
        file = os.open(self.path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0) | new, 0o644)
        if not _lock_file(file):
            os.close(file)
            raise BadFile(self.path, "in use", "a file to record into", "Another process is recording into it.")
        size = os.fstat(file).st_size
        _write_all(file, FILE_HEADER[size:])
        return file

    def _what_is_there(self) -> Recording | None:
        """The recording to go on with; None for a new file."""
        try:
            mode = self.path.stat().st_mode
            if not stat.S_ISREG(mode):
                advice = "Nothing was sent to it. The port comes first: `harness record PORT FILE`."
                raise BadFile(self.path, "no ordinary file", "a file to record into", advice)
            if not os.access(self.path, os.W_OK):
                raise PermissionError("it is not yours to write")
            data = self.path.read_bytes()
        except FileNotFoundError:
            if not self.path.parent.is_dir():
                raise BadFile(self.path, "no such folder", "a file to record into", "Make the folder first.") from None
            return None
        except OSError as error:
            raise _file_error(self.path, error) from error
        _check_kind(self.path, data)
        return Recording(self.path, data)


def record_capture(
    path: Path | str, wire: WireFormat, capture: ByteCapture, note: Mapping[str, Any], *, seconds: float = math.inf
) -> RecordingWriter:
    """Write what a simulated line carried (in its first so many seconds), chunk by chunk.

    The simulation's clock stands for both of the host's. Returns the writer, closed, for its counts.
    """
    ends, received_s = capture.ends.tolist(), capture.received_s.tolist()
    with RecordingWriter(path, note) as writer:
        start_s = received_s[0] if received_s else 0.0
        writer.on_configured(wire, start_s, start_s)
        for begin, end, now_s in zip([0, *ends], ends, received_s, strict=False):
            if now_s - start_s < seconds:
                writer.on_received(capture.data[begin:end], now_s, now_s)
    return writer


def _write_all(file: int, data: bytes) -> None:
    """All of it, though the system may take it in parts."""
    left = memoryview(data)
    while left:
        left = left[os.write(file, left) :]


def _lock_file(file: int) -> bool:
    """Whether nobody else records into the file, where the system can tell."""
    try:
        import fcntl
    except ImportError:  # Windows
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _file_error(path: Path, error: OSError) -> BadFile:
    if isinstance(error, IsADirectoryError):
        return BadFile(path, "a folder", EXPECTED_FILE, "Name a file in it.")
    if isinstance(error, FileNotFoundError):
        return BadFile(path, "no such file", EXPECTED_FILE, "`harness record PORT FILE` makes one.")
    return BadFile(
        path, f"cannot be used ({error.strerror or error})", EXPECTED_FILE, "What it held before is still there."
    )


def _damage_text(lost: DamagedSpan, before_s: float | None, after_s: float) -> str:
    what = f"bytes {lost.begin} to {lost.end} are damaged"
    if before_s is None:
        return f"{what}: the beginning, until {after_s:.3f} s"
    return f"{what}: between {before_s:.3f} s and {after_s:.3f} s of the host's clock"


def _truncation_text(lost: DamagedSpan, before_s: float | None) -> str:
    when = "" if before_s is None else f", from {before_s:.3f} s of the host's clock on"
    return f"the last {lost.end - lost.begin} bytes are no whole block: cut off{when}"
