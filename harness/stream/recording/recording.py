"""Recordings: everything that passed over the line, in both directions, with the host's times.

The file layout is described in `blocks.py`. A recording only grows, by whole blocks. A crash or a damaged disk
costs only the blocks it touches, and these are reported. A recording that was cut off can be continued. Blocks by kind:

    recv, sent   bytes from and to the device; an empty recv block: nothing arrived and an overdue frame was closed
    conf         JSON of the `WireFormat` of the bytes that follow; the device's clock starts at zero there
    evnt         JSON of an event on the line, as the driver reported it
    note         JSON of the origin of what follows: the port, or the scenario, clip, seed, stations and rate; "plan" is
                 the digest of the trust plan that the recording is made for, the same in every note of a file
    answ         JSON of a command that a person sent, with the bytes and the decoded values of its answer
    mark         JSON of the stretch of a capture that begins here and lasts to the next mark, such as
                 {"stretch": "static"}; the stretch "" ends one
    body, pose   poses of another program in place of bytes (`pose_recording.py`), in files of version 2
"""

import json
import math
import os
import stat
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import islice, pairwise
from pathlib import Path
from threading import Lock
from types import TracebackType
from typing import Any, BinaryIO, Self

import numpy as np

from harness.core.fault_report import is_system_fault
from harness.core.fields import build
from harness.core.file_kind import wrong_file
from harness.core.input_file import MEGABYTE, open_input_file, read_input_file
from harness.core.interrupts import defer_interrupts
from harness.core.output_place import place_fault
from harness.core.parsing import parse_json
from harness.errors import BadFile, HarnessError, SystemFault, shorten, was_interrupted
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.codec.reader import ByteCapture, WireFormat
from harness.stream.recording.blocks import (
    ANSWERED,
    CONFIGURED,
    EVENT,
    FILE_HEADER,
    MARK,
    MAX_PAYLOAD_BYTES,
    NOTE,
    POSES_VERSION,
    RECEIVED,
    SENT,
    DamagedSpan,
    RecordingBlock,
    encode_block,
    read_blocks,
    read_version,
    scan_blocks,
)

EXPECTED_FILE = "a recording by `harness record`"
PLAN_FILE = "plan"
"""Name of the plan's digest in a note."""
_WRITABLE_FILE = "a file to record into"
_MAX_ANSWER_BYTES = 8192
"""Most bytes of an answer that are repeated next to its decoded values."""
_KIND_BYTES = 1 << 20
"""Bytes in which the beginning of a recording whose header is damaged must have a whole block."""
_CHUNKS_PER_WRITE = 4096
MAX_BYTES = 2048 * MEGABYTE
"""Largest recording that is read: some two days of a full serial line."""


@dataclass(frozen=True, eq=False)
class Recording:
    """The content of a recording at the time it was read."""

    path: Path
    data: bytes

    def blocks(self) -> Iterator[RecordingBlock]:
        """Yield every whole block, in file order."""
        return (entry for entry in self._entries() if isinstance(entry, RecordingBlock))

    @cached_property
    def damage(self) -> tuple[str, ...]:
        """Descriptions of the damaged or truncated parts, in file order."""
        out: list[str] = []
        deque(describe_damage(self._entries(), out), maxlen=0)
        return tuple(out)

    @cached_property
    def formats(self) -> tuple[WireFormat, ...]:
        """Wire format of each configuration of the device. Raises BadFile when one cannot be read."""
        return tuple(self.format_of(block) for block in self.blocks() if block.kind == CONFIGURED)

    @cached_property
    def note(self) -> dict[str, Any]:
        """The latest note on the origin of the recording; empty when there is none."""
        notes = [block for block in self.blocks() if block.kind == NOTE]
        return self.parse_json(notes[-1]) if notes else {}

    def note_values(self, name: str) -> tuple[str, ...]:
        """The different values that the notes have under a name, in file order.

        "" stands for a note without the name, and for blocks that come before the first note.
        """
        return note_values(self, self.blocks(), name)

    @property
    def events(self) -> list[dict[str, Any]]:
        """Events on the line: kind, text, time on the host's clock [s] and time since the first block [s]."""
        event_blocks = [block for block in self.blocks() if block.kind == EVENT]
        first_s = next(iter(self.blocks())).monotonic_s if event_blocks else 0.0
        times = [{"monotonic_s": block.monotonic_s, "elapsed_s": block.monotonic_s - first_s} for block in event_blocks]
        return [{**at, **self._event(block)} for at, block in zip(times, event_blocks, strict=True)]

    @property
    def marks(self) -> list[dict[str, Any]]:
        """Marks of stretches, with the time on the host's clock [s] at which each begins."""
        return self.timed_contents(MARK, self.blocks())

    @property
    def answers(self) -> list[dict[str, Any]]:
        """Commands that a person sent, with their answers and the time on the host's clock [s]."""
        return self.timed_contents(ANSWERED, self.blocks())

    def timed_contents(self, kind: str, blocks: Iterable[RecordingBlock]) -> list[dict[str, Any]]:
        """The JSON of the blocks of a kind, with their time on the host's clock [s]."""
        return [{"monotonic_s": b.monotonic_s, **self.parse_json(b)} for b in blocks if b.kind == kind]

    def format_of(self, configured: RecordingBlock) -> WireFormat:
        """Parse the wire format in a "conf" block. Raises BadFile."""
        content = self.parse_json(configured)
        try:
            content["characters"] = str(content.get("characters", "")).encode()
            return build(WireFormat, content, "wire format")
        except (TypeError, HarnessError) as error:
            raise BadFile(self.path, f"an unusable wire format ({error})", EXPECTED_FILE, "") from error

    def _event(self, block: RecordingBlock) -> dict[str, str]:
        content = self.parse_json(block)
        if not all(isinstance(content.get(name), str) for name in ("kind", "text")):
            raise BadFile(self.path, "an event without kind and text", EXPECTED_FILE, "Record again.")
        return {name: shorten(content[name]) for name in ("kind", "text")}

    def parse_json(self, block: RecordingBlock) -> dict[str, Any]:
        """Parse a block of JSON; an empty mapping for JSON of another kind. Raises BadFile."""
        try:
            content = parse_json(block.payload.decode("utf-8"))
        except ValueError as error:
            raise BadFile(self.path, f"a {block.kind} block that is not JSON", EXPECTED_FILE, "") from error
        return content if isinstance(content, dict) else {}

    def _entries(self) -> Iterator[RecordingBlock | DamagedSpan]:
        return read_blocks(self.data, len(FILE_HEADER) if read_version(self.data) else 0)


def read_recording(path: Path | str) -> Recording:
    """Read a recording, whatever part of it is damaged or truncated.

    Raises BadFile for a file that is no recording, or one of a newer version.
    """
    path = Path(path)
    data = read_input_file(path, EXPECTED_FILE, MAX_BYTES, "`harness record PORT FILE` makes one.")
    if not data:
        raise BadFile(path, "an empty file", EXPECTED_FILE, "Nothing was recorded into it.")
    _check_kind(path, data)
    return Recording(path, data)


def open_recording(path: Path) -> BinaryIO:
    """Open a recording at its first block, to read it in pieces. Raises BadFile as `read_recording`."""
    file = open_input_file(path, EXPECTED_FILE, MAX_BYTES, "`harness record PORT FILE` makes one.")
    try:
        if not _seek_first_block(path, file):
            raise BadFile(path, "an empty file", EXPECTED_FILE, "Nothing was recorded into it.")
    except BadFile:
        file.close()
        raise
    return file


def _seek_first_block(path: Path, file: BinaryIO) -> bool:
    """Go to the first block of a file; False in an empty one. Raises BadFile unless it is a recording."""
    head = file.read(_KIND_BYTES)
    _check_kind(path, head)
    file.seek(len(FILE_HEADER) if read_version(head) else 0)
    return bool(head)


def read_marks(path: Path) -> list[dict[str, Any]]:
    """Return what `Recording.marks` has, from a file that is read in pieces. Raises BadFile as `read_recording`."""
    with open_recording(path) as file:
        return Recording(path, b"").timed_contents(MARK, whole_blocks(file))


def note_values(parser: Recording, blocks: Iterable[RecordingBlock], name: str) -> tuple[str, ...]:
    """As `Recording.note_values`, of these blocks."""
    values: dict[str, None] = {}
    for block in blocks:
        if block.kind == NOTE:
            values[str(parser.parse_json(block).get(name) or "")] = None
        elif not values:
            values[""] = None
    return tuple(values)


def whole_blocks(file: BinaryIO) -> Iterator[RecordingBlock]:
    """Yield the whole blocks of a file from its present position on; it is read in pieces."""
    return (entry for entry in scan_blocks(file) if isinstance(entry, RecordingBlock))


def describe_damage(entries: Iterable[RecordingBlock | DamagedSpan], damage: list[str]) -> Iterator[RecordingBlock]:
    """Yield the whole blocks, and append a description of each damaged part between them to `damage`.

    Its times count from the first whole block.
    """
    damaged: DamagedSpan | None = None
    first_s = before_s = None
    for entry in entries:
        if isinstance(entry, DamagedSpan):
            damaged = entry
            continue
        first_s = entry.monotonic_s if first_s is None else first_s
        now_s = entry.monotonic_s - first_s
        if damaged:
            damage.append(_damage_text(damaged, before_s, now_s))
        damaged, before_s = None, now_s
        yield entry
    if damaged:
        damage.append(_truncation_text(damaged, before_s))


def _check_kind(path: Path, data: bytes) -> None:
    """Raise BadFile unless the file is a recording or the beginning of one."""
    version = read_version(data)
    if version == POSES_VERSION:
        expected = "a recording of a device's line"
        raise BadFile(path, "a recording of poses", expected, "`harness inspect`, `replay` and `view` read it.")
    if version is not None and version > POSES_VERSION:
        problem, known = f"a recording of version {version}", f"version {POSES_VERSION} at most"
        raise BadFile(path, problem, known, "Use the newer version of the harness that made it.")
    if (
        version is None
        and not FILE_HEADER.startswith(data)
        and all(isinstance(entry, DamagedSpan) for entry in read_blocks(data, 0))
    ):
        advice = "Is it the right file? What other poses lack, `harness inspect` says. Nothing was changed."
        raise wrong_file(path, "no recording", EXPECTED_FILE, advice)


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
        _seek_first_block(self.path, file)
        parser, blocks = Recording(self.path, b""), whole_blocks(file)
        kept = [*islice(blocks, 1), *(block for block in blocks if block.kind in (CONFIGURED, NOTE))]
        self._check_plan(note_values(parser, kept, PLAN_FILE))
        for block in kept:
            if block.kind == CONFIGURED:
                self._stations = parser.format_of(block).stations

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


def _damage_text(span: DamagedSpan, before_s: float | None, after_s: float) -> str:
    what = f"bytes {span.begin} to {span.end} are damaged"
    if before_s is None:
        return f"{what}: the beginning; times count from the first whole block"
    return f"{what}: between {before_s:.3f} s and {after_s:.3f} s"


def _truncation_text(span: DamagedSpan, before_s: float | None) -> str:
    when = "" if before_s is None else f", from {before_s:.3f} s on"
    return f"the last {span.end - span.begin} bytes are cut off{when}"
