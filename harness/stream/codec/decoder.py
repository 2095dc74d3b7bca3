"""Bytes in, events out: finds data records and replies in the stream of an IS-900, without input or output.

There is no checksum and no escape: a record is known by its head and its length, by the CR LF (or space) that its
output list may end in, by the marks of 16-bit values and, in ASCII, by the shape of its numbers. While in step, a
record counts once its last byte is there. Out of step, the head of whatever follows must be there too; so it must for
lists that end in nothing fixed, where one byte of it may be damaged while in step. Every decision depends on the
bytes alone, never on how they were cut into chunks. Between records, lines that start with 2, 3 or 5 are replies.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from harness.stream.codec.items import HEADER_BYTES, RECORD_HEAD, STATION_CHARACTERS
from harness.stream.codec.layout import RecordLayout, record_head_pattern
from harness.stream.codec.records import RecordFormat, Table

LONGEST_REPLY = 256
"""No reply in the sources is half as long [bytes]."""
_REPLY_HEAD_PATTERN = rb"(?:[235][1-9A-Ca-c][A-Za-z]|[235] E)"
"""What the lines of section 6 begin with: a station and a letter, or an error."""
_STATUS_BYTES = b" ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
_RECORD_HEAD_BYTES = b"0", STATION_CHARACTERS, _STATUS_BYTES
_REPLY_HEAD_BYTES = (b"235", b"123456789ABCabc", _STATUS_BYTES[1:]), (b"235", b" ", b"E")
_UNPRINTABLE = re.compile(rb"[^ -~]")


@dataclass(frozen=True, eq=False)
class RecordRun:
    """A run of records of one output list, without a byte between them."""

    offset: int
    """Bytes of the stream before the run."""
    items: tuple[int, ...]
    table: Table
    size: int
    """Bytes of a record on the wire, which in ASCII are not those of a row of the table."""

    @property
    def nbytes(self) -> int:
        """Bytes of the run on the wire."""
        return self.size * len(self.table)


@dataclass(frozen=True)
class Reply:
    """A line that is no data."""

    offset: int
    line: bytes
    """Without its CR LF."""


@dataclass(frozen=True)
class Garbage:
    """Bytes that belong to nothing."""

    offset: int
    size: int


DecoderEvent = RecordRun | Reply | Garbage


def merge_adjacent(events: Iterable[DecoderEvent]) -> list[DecoderEvent]:
    """The same events with neighbours made one wherever they touch: what any split of the bytes gives alike."""
    out: list[DecoderEvent] = []
    for event in events:
        last = out[-1] if out else None
        if isinstance(event, Garbage) and isinstance(last, Garbage) and last.offset + last.size == event.offset:
            out[-1] = Garbage(last.offset, last.size + event.size)
        elif (
            isinstance(event, RecordRun)
            and isinstance(last, RecordRun)
            and last.items == event.items
            and last.offset + last.nbytes == event.offset
        ):
            out[-1] = RecordRun(last.offset, last.items, np.concatenate([last.table, event.table]), last.size)
        else:
            out.append(event)
    return out


class Decoder:
    """Keeps at most one undecided record or reply between calls, whatever comes in.

    A device that was given another list or format is read with a new decoder.
    """

    def __init__(self, lists: Mapping[int, tuple[int, ...]], settings: RecordFormat | None = None) -> None:
        """`lists` is the output list of each station, by its character's code. Records of others are garbage."""
        heads = b"(?:%b|%b)" % (record_head_pattern(STATION_CHARACTERS), _REPLY_HEAD_PATTERN)
        self._layouts: dict[int, RecordLayout] = {}
        for items in set(lists.values()):
            stations = bytes(station for station, own in lists.items() if own == items)
            self._layouts |= dict.fromkeys(stations, RecordLayout(items, stations, settings or RecordFormat(), heads))
        self._head = re.compile(heads)
        self._buffer = b""
        self._offset = 0
        """Bytes of the stream before the buffer."""
        self._in_step = False

    @property
    def pending(self) -> int:
        """Bytes that wait for more."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[DecoderEvent]:
        """What became certain with these bytes."""
        return self._decode(self._buffer + data, ended=False)

    def finish(self) -> list[DecoderEvent]:
        """What is left when nothing more will come: the end stands for the head of the next record."""
        return self._decode(self._buffer, ended=True)

    def _decode(self, buffer: bytes, ended: bool) -> list[DecoderEvent]:
        events: list[DecoderEvent] = []
        at = 0
        while at < len(buffer):
            taken = self._run(buffer, at, events)
            if taken == 0:
                taken = self._single(buffer, at, events, ended)
            if taken == 0:
                break
            at += taken
        self._buffer = buffer[at:]
        self._offset += at
        return merge_adjacent(events)

    def _run(self, buffer: bytes, at: int, events: list[DecoderEvent]) -> int:
        """Take as many whole records of one list as follow each other in step; the bytes they have."""
        layout = self._layouts.get(buffer[at + 1]) if self._in_step and at + 1 < len(buffer) else None
        found = layout.run.match(buffer, at) if layout else None
        if layout is None or found is None or found.end() == at:
            return 0
        taken = found.end() - at
        table = layout.table(buffer, at, taken // layout.size)
        events.append(RecordRun(self._offset + at, layout.items, table, layout.size))
        return taken

    def _single(self, buffer: bytes, at: int, events: list[DecoderEvent], ended: bool) -> int:
        """Take one record, reply or piece of garbage; the bytes it has, 0 when more are needed to tell."""
        head = buffer[at : at + HEADER_BYTES]
        if not self._may_begin(head):
            size: int | None = 0
        elif len(head) < HEADER_BYTES:
            size = 0 if ended else None
        else:
            size = (self._size_of_record if head[0] == RECORD_HEAD else _size_of_reply)(buffer, at, ended)
        if size is None:
            return 0
        self._in_step = size > 0
        if size == 0:
            size = self._next_head(buffer, at + 1) - at
            events.append(Garbage(self._offset + at, size))
        elif head[0] == RECORD_HEAD:
            layout = self._layouts[head[1]]
            events.append(RecordRun(self._offset + at, layout.items, layout.table(buffer, at, 1), layout.size))
        else:
            events.append(Reply(self._offset + at, buffer[at : at + size - 2]))
        return size

    def _size_of_record(self, buffer: bytes, at: int, ended: bool) -> int | None:
        """Bytes of the record at this place; 0 if it is none, None when it cannot be told yet."""
        layout = self._layouts.get(buffer[at + 1])
        if layout is None:
            return 0
        after = at + layout.size
        if after > len(buffer):
            return 0 if ended else None
        if not layout.record.match(buffer, at):
            return 0
        if self._in_step and layout.end:
            return layout.size
        follows = buffer[after : after + HEADER_BYTES]
        if len(follows) < HEADER_BYTES and not ended:
            return None
        return layout.size if self._may_begin(follows) or (self._in_step and self._one_off(follows)) else 0

    def _may_begin(self, head: bytes) -> bool:
        """Whether these bytes, three or fewer, begin a record or a reply."""
        if len(head) == HEADER_BYTES:
            return self._head.match(head) is not None
        return any(
            all(byte in own for byte, own in zip(head, places, strict=False))
            for places in (_RECORD_HEAD_BYTES, *_REPLY_HEAD_BYTES)
        )

    def _one_off(self, head: bytes) -> bool:
        """Whether these bytes are a record's head but for one."""
        amiss = [byte not in own for byte, own in zip(head, _RECORD_HEAD_BYTES, strict=False)]
        return len(head) == HEADER_BYTES and sum(amiss) == 1

    def _next_head(self, buffer: bytes, at: int) -> int:
        """Where the next record or reply may begin, from here on; the end of the buffer where nothing can."""
        found = self._head.search(buffer, at)
        if found:
            return found.start()
        last = range(max(at, len(buffer) - HEADER_BYTES + 1), len(buffer))
        return next((k for k in last if self._may_begin(buffer[k:])), len(buffer))


def _size_of_reply(buffer: bytes, at: int, ended: bool) -> int | None:
    """Bytes of the line at this place; 0 if it is none, None when it cannot be told yet."""
    broken = _UNPRINTABLE.search(buffer, at, at + LONGEST_REPLY)
    if broken is None:
        return 0 if ended or len(buffer) - at >= LONGEST_REPLY else None
    stop = broken.start()
    end = buffer[stop : stop + 2]
    if end == b"\r\n":
        return stop + 2 - at
    return None if end == b"\r" and not ended else 0
