"""Recordings as they are written: by the driver of a device, or of a simulated line (`recording.py` has the format)."""

import json
import math
import os
import stat
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from itertools import islice, pairwise
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import Any, BinaryIO, Self

import numpy as np

from harness.core.fault_report import is_system_fault
from harness.core.input_file import open_input_file
from harness.core.interrupts import defer_interrupts
from harness.core.output_place import place_fault
from harness.errors import BadFile, SystemFault, was_interrupted
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.codec.reader import ByteCapture, WireFormat
from harness.stream.recording.block_content import EXPECTED_FILE, PLAN_FILE, note_values, wire_format_of
from harness.stream.recording.blocks import (
    ANSWERED,
    CONFIGURED,
    EVENT,
    FILE_HEADER,
    MARK,
    MAX_PAYLOAD_BYTES,
    NOTE,
    RECEIVED,
    SENT,
    RecordingBlock,
    encode_block,
)
from harness.stream.recording.recording import MAX_BYTES, seek_first_block, whole_blocks

_WRITABLE_FILE = "a file to record into"
_MAX_ANSWER_BYTES = 8192
"""Most bytes of an answer that are repeated next to its decoded values."""
_CHUNKS_PER_WRITE = 4096


class RecordingWriter:
    """Appends to a recording; it is a `LineObserver` of the driver.

    Blocks are handed to the operating system at once, so that a process that dies loses no finished block. The file is
    checked when the writer is made, and opened at the first write. Raises BadFile for a file that is no recording, that
    another process is recording into, or that cannot be written.
    """

    _header = FILE_HEADER

    def __init__(self, path: Path | str, note: Mapping[str, Any] | None = None) -> None:
        """Check the file. `note` describes the origin of the recording."""
        self.path = Path(path)
        self.counts = dict.fromkeys((RECEIVED, SENT, CONFIGURED, EVENT, ANSWERED, MARK), 0)
        """Bytes received and sent, and numbers of configurations, events, answers and marks, by block kind."""
        self._note = dict(note or {})
        self._stations: tuple[str, ...] | None = None
        self._new = not self._find_existing()
        self._file: int | None = None
        self._closed = self._kept = False
        self._begin_bytes = 0
        """Length of the file before this writer [bytes]."""
        self._lock = Lock()
        """Held while writing: the thread that reads and the one that closes both write."""

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        """Write bytes received from the device."""
        self._append(*_split(RECEIVED, data, monotonic_s, wall_s))
        self.counts[RECEIVED] += len(data)

    def on_simulated(self, chunks: Sequence[tuple[float, bytes]]) -> None:
        """Write chunks of a simulated line, each with its time of reception on both of the host's clocks [s]."""
        self._append(*(block for now_s, data in chunks for block in _split(RECEIVED, data, now_s, now_s)))
        self.counts[RECEIVED] += sum(len(data) for _, data in chunks)

    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        """Write bytes sent to the device."""
        self._append(*_split(SENT, data, monotonic_s, wall_s))
        self.counts[SENT] += len(data)

    def on_configured(self, wire: WireFormat, monotonic_s: float | None = None, wall_s: float | None = None) -> None:
        """Write the wire format.

        Raises BadFile for other stations than before, because a stream's stations never change.
        """
        self._keep_stations(wire.stations)
        content = asdict(wire) | {"characters": wire.characters.decode("latin-1")}
        for name, usual in (("zeroed", True), ("datagrams", False), ("family", "is900")):
            if content[name] == usual:
                del content[name]  # earlier versions refuse a key that they do not know
        self._append_json(CONFIGURED, content, monotonic_s, wall_s)
        self.counts[CONFIGURED] += 1

    def _keep_stations(self, stations: tuple[str, ...]) -> None:
        """Raise BadFile for other stations than before."""
        if self._stations not in (None, stations):
            raise BadFile(
                self.path,
                f"a recording of the stations {', '.join(self._stations or ())}",
                f"one of {', '.join(stations)}",
                "Record other stations into another file.",
            )
        self._stations = stations

    def on_event(self, event: LineEvent) -> None:
        """Write an event on the line."""
        self._append_json(EVENT, {"kind": event.kind, "text": event.text}, event.monotonic_s, event.wall_s)
        self.counts[EVENT] += 1

    def on_mark(
        self, content: Mapping[str, Any], monotonic_s: float | None = None, wall_s: float | None = None
    ) -> None:
        """Write a mark: from here on the capture is the stretch that `content` names under "stretch"."""
        self._append_json(MARK, content, monotonic_s, wall_s)
        self.counts[MARK] += 1

    def on_answer(self, content: Mapping[str, Any]) -> None:
        """Write a command with its answer (`driver.exchange`), as much of it as fits; `recv` blocks have all of it."""
        fitting = {**content, "received": content["received"][: 3 * _MAX_ANSWER_BYTES]}
        while len(json.dumps(fitting)) > MAX_PAYLOAD_BYTES:
            fitting["answers"] = fitting["answers"][: len(fitting["answers"]) // 2]
        self._append_json(ANSWERED, fitting)
        self.counts[ANSWERED] += 1

    @property
    def empty(self) -> bool:
        """Whether no device was ever configured or answered, and no program used it: nothing usable was recorded."""
        return not (self._kept or self.counts[CONFIGURED] or self.counts[ANSWERED])

    def discard(self) -> None:
        """Take back everything that this writer has written, and close it; the file is as it was before."""
        with self._lock:
            if self._file is not None:
                os.ftruncate(self._file, self._begin_bytes)
        self._kept, self.counts = False, dict.fromkeys(self.counts, 0)
        self.close()

    def keep(self) -> None:
        """Keep a new file also when no device was configured in it: a program used the device."""
        self._kept = True

    def close(self) -> None:
        """Flush everything to the disk and close the file; may be called twice.

        A new file is removed when no device was ever configured or answered in it and no program used it: it contains
        nothing usable.
        """
        with self._lock:
            self._closed = True
            if self._file is not None:
                os.fsync(self._file)
                os.close(self._file)
                self._file = None
                if self._new and self.empty:
                    self.path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def _append_json(
        self, kind: str, content: Mapping[str, Any], monotonic_s: float | None = None, wall_s: float | None = None
    ) -> None:
        now_s = time.monotonic() if monotonic_s is None else monotonic_s
        then_s = time.time() if wall_s is None else wall_s
        self._append(RecordingBlock(kind, now_s, then_s, json.dumps(content, default=str).encode()))

    def _append(self, *blocks: RecordingBlock) -> None:
        data = b"".join(map(encode_block, blocks))
        with defer_interrupts(), self._lock:  # blocks are written whole
            if self._closed or not blocks:
                return
            try:
                if self._file is None:
                    self._file = self._open_file()
                    first = blocks[0]
                    note = json.dumps(self._note, default=str).encode()
                    _write_all(self._file, encode_block(RecordingBlock(NOTE, first.monotonic_s, first.wall_s, note)))
                _write_all(self._file, data)
            except OSError as error:
                if is_system_fault(error):
                    kept = "Blocks that were recorded before are kept; free some space and record into another file."
                    raise SystemFault(f"{self.path} cannot be written ({error.strerror}).", kept) from error
                raise _file_error(self.path, error) from error

    def _open_file(self) -> int:
        """Open the file with an exclusive lock and complete its header."""
        new = os.O_CREAT | os.O_EXCL if self._new else 0
        file = os.open(self.path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0) | new, 0o644)
        if not _lock_file(file):
            os.close(file)
            raise BadFile(self.path, "in use", _WRITABLE_FILE, "Another process is recording into it.")
        self._begin_bytes = os.fstat(file).st_size
        _write_all(file, self._header[self._begin_bytes :])
        return file

    def _find_existing(self) -> bool:
        """Whether there is a recording to continue, which is then checked. Raises BadFile."""
        try:
            mode = self.path.stat().st_mode
            if not stat.S_ISREG(mode):
                advice = "Nothing was written to it. The port comes first: `harness record PORT FILE`."
                raise BadFile(self.path, "no regular file", _WRITABLE_FILE, advice)
            if not os.access(self.path, os.W_OK):
                raise PermissionError("you may not write to it")
            with open_input_file(self.path, EXPECTED_FILE, MAX_BYTES) as file:
                self._read_existing(file)
            return True
        except (FileNotFoundError, NotADirectoryError):
            if fault := place_fault(self.path.parent):
                raise BadFile(self.path, fault, _WRITABLE_FILE, "Choose another.") from None
            if not self.path.parent.is_dir():
                raise BadFile(self.path, "no such folder", _WRITABLE_FILE, "Make the folder first.") from None
            return False
        except OSError as error:
            raise _file_error(self.path, error) from error

    def _read_existing(self, file: BinaryIO) -> None:
        """Read what the recording to continue says about its plan and stations. Raises BadFile."""
        seek_first_block(self.path, file)
        blocks = whole_blocks(file)
        kept = [*islice(blocks, 1), *(block for block in blocks if block.kind in (CONFIGURED, NOTE))]
        self._check_plan(note_values(self.path, kept, PLAN_FILE))
        for block in kept:
            if block.kind == CONFIGURED:
                self._stations = wire_format_of(self.path, block).stations

    def _check_plan(self, existing: tuple[str, ...]) -> None:
        """Raise BadFile unless the notes of the file name the plan of the new one: a plan comes before its data."""
        plan = str(self._note.get(PLAN_FILE) or "")
        if not existing or existing == (plan,):
            return
        found = " and ".join(f"the plan {digest[:12]}" if digest else "no plan" for digest in existing)
        expected = f"one for the plan {plan[:12]}" if plan else "one for no plan"
        advice = "Record into another file: a plan stands in a recording before its first data, and is never renewed."
        raise BadFile(self.path, f"a recording for {found}", expected, advice)


def record_capture(
    path: Path | str,
    wire: WireFormat,
    capture: ByteCapture,
    note: Mapping[str, Any],
    *,
    seconds: float = math.inf,
    marks: Sequence[tuple[float, str]] = (),
) -> RecordingWriter:
    """Record what a simulated line carried in its first `seconds`, chunk by chunk.

    The simulation's clock serves as both of the host's clocks. `marks` are the times on it [s] at which stretches
    begin, in order, and their names. Returns the writer, closed, for its counts. An interrupt leaves the file as it was
    before: the same command would otherwise append to a part.
    """
    ends, received_s = capture.ends.tolist(), capture.received_s.tolist()
    begins = [0, *ends]
    with RecordingWriter(path, note) as writer, _undone_by_interrupts(writer):
        start_s = received_s[0] if received_s else 0.0
        writer.on_configured(wire, start_s, start_s)
        count = int(np.count_nonzero(capture.received_s - start_s < seconds))
        rows = capture.received_s.searchsorted([at_s for at_s, _ in marks]).tolist()
        stretch_at = {row: mark for row, mark in zip(rows, marks, strict=True) if row < count}
        for first, last in pairwise(sorted({*range(0, count, _CHUNKS_PER_WRITE), *stretch_at, count})):
            if first in stretch_at:
                at_s, stretch = stretch_at[first]
                writer.on_mark({"stretch": stretch}, at_s, at_s)
            writer.on_simulated([(received_s[i], capture.data[begins[i] : ends[i]]) for i in range(first, last)])
    return writer


@contextmanager
def _undone_by_interrupts(writer: RecordingWriter) -> Iterator[None]:
    try:
        yield
    except (KeyboardInterrupt, Exception) as error:
        if was_interrupted(error):
            writer.discard()
        raise


def _split(kind: str, data: bytes, monotonic_s: float, wall_s: float) -> Iterator[RecordingBlock]:
    """Yield the blocks that hold the data: one, or as many as their length demands."""
    for begin in range(0, max(len(data), 1), MAX_PAYLOAD_BYTES):
        yield RecordingBlock(kind, monotonic_s, wall_s, data[begin : begin + MAX_PAYLOAD_BYTES])


def _write_all(file: int, data: bytes) -> None:
    """Write all of the data, although the operating system may take it in parts."""
    remaining = memoryview(data)
    while remaining:
        remaining = remaining[os.write(file, remaining) :]


def _lock_file(file: int) -> bool:
    """Lock the file for this process; False when another process holds it. Windows has no such lock: always True."""
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
        return BadFile(path, "a folder", EXPECTED_FILE, "Name a file in that folder.")
    if isinstance(error, FileNotFoundError):
        return BadFile(path, "no such file", EXPECTED_FILE, "`harness record PORT FILE` makes one.")
    return BadFile(
        path, f"cannot be used ({error.strerror or error})", EXPECTED_FILE, "Its earlier content is unchanged."
    )
