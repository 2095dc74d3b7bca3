"""Decoder: finds data records and replies in the bytes of an IS-900; no input or output.

There is no checksum and no escape. A record is recognised by its head and length, by the CR LF (or space) that its
output list may end in, by the marks of 16-bit values and, in ASCII, by the format of its numbers. While in step, a
record is accepted once its last byte is there. Out of step, the head of the next record or reply must be there too. The
same holds in step for lists without a fixed end, where one byte of that head may be damaged. Every decision depends on
the bytes alone, never on how they were split into chunks. Between records, lines that start with 2, 3 or 5 are replies.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from harness.stream.polhemus.codec.items import (
    HEADER_BYTES,
    RECORD_HEAD,
    STATION_CHARACTERS,
    OutputItem,
    record_size,
    record_type,
    resolve_items,
    terminator,
)
from harness.stream.polhemus.codec.records import RecordFormat, Table, item_pattern, parse_records


class RecordLayout:
    """The records of one output list, from these stations, in this format."""

    def __init__(self, items: tuple[int, ...], stations: bytes, settings: RecordFormat, next_head: bytes) -> None:
        """`next_head` is a regular expression of what may follow a record."""
        self.items = items
        self.size = record_size(items, settings.binary, settings.stylus_bytes)
        self.end = terminator(items)
        """Fixed bytes at the end of every record; empty where there are none."""
        self._binary, self._stylus_bytes = settings.binary, settings.stylus_bytes
        output_items = resolve_items(items, settings.stylus_bytes)
        record = record_head_pattern(stations) + b"".join(self._expression(item) for item in output_items)
        lookahead = b"" if self.end else b"(?=%b)" % next_head
        self.record = re.compile(record, re.DOTALL)
        self.run = re.compile(b"(?:%b%b)*+" % (record, lookahead), re.DOTALL)
        """Matches as many adjacent records as possible. Without a fixed end, each must be followed by a head."""

    def table(self, buffer: bytes, offset: int, count: int) -> Table:
        """Parse `count` records that begin at this offset and match `record` into a table (N,)."""
        if self._binary:
            return np.frombuffer(buffer, record_type(self.items, self._stylus_bytes), count, offset)
        raw = np.frombuffer(buffer, np.uint8, count * self.size, offset).reshape(count, self.size)
        return parse_records(self.items, raw, self._stylus_bytes)

    def _expression(self, item: OutputItem) -> bytes:
        if item.fixed:
            return re.escape(item.fixed)
        if item.sevens:
            return rb"[\x80-\xff][\x00-\x7f]{%d}" % (item.count - 1)
        if item.width and not self._binary:
            return item_pattern(item)
        return b".{%d}" % np.dtype((item.kind, item.count)).itemsize


def record_head_pattern(stations: bytes) -> bytes:
    """Return a regular expression of a record's head.

    A blank is the status of an IS-900, a letter that of a Fastrak.
    """
    return b"0[%b][ A-Za-z]" % stations


LONGEST_REPLY = 256
"""Longest reply; no reply in the sources is half as long [bytes]."""
_REPLY_HEAD_PATTERN = rb"(?:[235][1-9A-Ca-c][A-Za-z]|[235] E)"
"""Beginning of the reply lines of docs/is900.md 6: a station and a letter, or an error."""
_STATUS_BYTES = b" ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
_RECORD_HEAD_BYTES = b"0", STATION_CHARACTERS, _STATUS_BYTES
_REPLY_HEAD_BYTES = (b"235", b"123456789ABCabc", _STATUS_BYTES[1:]), (b"235", b" ", b"E")
_UNPRINTABLE = re.compile(rb"[^ -~]")


@dataclass(frozen=True, eq=False)
class RecordRun:
    """A run of adjacent records of one output list."""

    offset: int
    """Offset of the run in the stream [bytes]."""
    items: tuple[int, ...]
    table: Table
    size: int
    """Length of a record on the wire [bytes]; in ASCII it differs from a row of the table."""

    @property
    def nbytes(self) -> int:
        """Length of the run on the wire [bytes]."""
        return self.size * len(self.table)


@dataclass(frozen=True)
class Reply:
    """A line that is not a data record."""

    offset: int
    line: bytes
    """The line without its CR LF."""


@dataclass(frozen=True)
class Garbage:
    """Bytes that belong to no record and no reply."""

    offset: int
    size: int
    station: int = 0
    """Code of the station, of which no list is known, whose record seems to begin in step here; 0 for none."""


DecoderEvent = RecordRun | Reply | Garbage


def merge_adjacent(events: Iterable[DecoderEvent]) -> list[DecoderEvent]:
    """Return the events with adjacent runs and adjacent garbage merged: the result is the same for any split of the
    bytes.
    """
    out: list[DecoderEvent] = []
    for event in events:
        last = out[-1] if out else None
        if (
            isinstance(event, Garbage)
            and isinstance(last, Garbage)
            and not event.station
            and last.offset + last.size == event.offset
        ):
            out[-1] = Garbage(last.offset, last.size + event.size, last.station)
        elif (
            isinstance(event, RecordRun)
            and isinstance(last, RecordRun)
            and (last.items, last.size) == (event.items, event.size)
            and last.offset + last.nbytes == event.offset
        ):
            out[-1] = RecordRun(last.offset, last.items, np.concatenate([last.table, event.table]), last.size)
        else:
            out.append(event)
    return out


class Decoder:
    """Decodes bytes to events. It keeps at most one undecided record or reply between calls.

    Use a new decoder when the device is given another list or format.
    """

    def __init__(self, lists: Mapping[int, tuple[int, ...]], settings: RecordFormat | None = None) -> None:
        """`lists` maps the code of each station's character to its output list.

        Records of other stations are garbage.
        """
        heads = b"(?:%b|%b)" % (record_head_pattern(STATION_CHARACTERS), _REPLY_HEAD_PATTERN)
        self._layouts: dict[int, RecordLayout] = {}
        for items in set(lists.values()):
            stations = bytes(station for station, accepted in lists.items() if accepted == items)
            self._layouts |= dict.fromkeys(stations, RecordLayout(items, stations, settings or RecordFormat(), heads))
        self._head = re.compile(heads)
        self._buffer = b""
        self._offset = 0
        """Offset of the buffer in the stream [bytes]."""
        self._in_step = False

    @property
    def pending(self) -> int:
        """Number of undecided bytes."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[DecoderEvent]:
        """Return the events that these bytes make certain."""
        return self._decode(self._buffer + data, at_end=False)

    def finish(self) -> list[DecoderEvent]:
        """Return the remaining events at the end of the stream, which counts as the head of the next record."""
        return self._decode(self._buffer, at_end=True)

    def _decode(self, buffer: bytes, at_end: bool) -> list[DecoderEvent]:
        events: list[DecoderEvent] = []
        offset = 0
        while offset < len(buffer):
            consumed = self._run(buffer, offset, events)
            if consumed == 0:
                consumed = self._single(buffer, offset, events, at_end)
            if consumed == 0:
                break
            offset += consumed
        self._buffer = buffer[offset:]
        self._offset += offset
        return merge_adjacent(events)

    def _run(self, buffer: bytes, offset: int, events: list[DecoderEvent]) -> int:
        """Take as many adjacent records of one list as there are in step; return their length [bytes]."""
        layout = self._layouts.get(buffer[offset + 1]) if self._in_step and offset + 1 < len(buffer) else None
        match = layout.run.match(buffer, offset) if layout else None
        if layout is None or match is None or match.end() == offset:
            return 0
        consumed = match.end() - offset
        table = layout.table(buffer, offset, consumed // layout.size)
        events.append(RecordRun(self._offset + offset, layout.items, table, layout.size))
        return consumed

    def _single(self, buffer: bytes, offset: int, events: list[DecoderEvent], at_end: bool) -> int:
        """Take one record, reply or piece of garbage; return its length [bytes], 0 when more bytes are needed."""
        head = buffer[offset : offset + HEADER_BYTES]
        if not self._may_begin(head):
            size: int | None = 0
        elif len(head) < HEADER_BYTES:
            size = 0 if at_end else None
        else:
            size = (self._size_of_record if head[0] == RECORD_HEAD else _size_of_reply)(buffer, offset, at_end)
        if size is None:
            return 0
        was_in_step, self._in_step = self._in_step, size > 0
        if size == 0:
            size = self._next_head(buffer, offset + 1) - offset
            events.append(Garbage(self._offset + offset, size, self._other_station(head) if was_in_step else 0))
        elif head[0] == RECORD_HEAD:
            layout = self._layouts[head[1]]
            events.append(RecordRun(self._offset + offset, layout.items, layout.table(buffer, offset, 1), layout.size))
        else:
            events.append(Reply(self._offset + offset, buffer[offset : offset + size - 2]))
        return size

    def _size_of_record(self, buffer: bytes, offset: int, at_end: bool) -> int | None:
        """Return the length of the record at this offset [bytes]; 0 if there is none, None when undecided."""
        layout = self._layouts.get(buffer[offset + 1])
        if layout is None:
            return 0
        record_end = offset + layout.size
        if record_end > len(buffer):
            return 0 if at_end else None
        if not layout.record.match(buffer, offset):
            return 0
        if self._in_step and layout.end:
            return layout.size
        next_head = buffer[record_end : record_end + HEADER_BYTES]
        if len(next_head) < HEADER_BYTES and not at_end:
            return None
        return layout.size if self._may_begin(next_head) or (self._in_step and self._has_one_error(next_head)) else 0

    def _may_begin(self, head: bytes) -> bool:
        """Whether these bytes, at most three, begin a record or a reply."""
        if len(head) == HEADER_BYTES:
            return self._head.match(head) is not None
        return any(
            all(byte in accepted for byte, accepted in zip(head, allowed, strict=False))
            for allowed in (_RECORD_HEAD_BYTES, *_REPLY_HEAD_BYTES)
        )

    def _other_station(self, head: bytes) -> int:
        """Return the station of a record's head if no list is known of it, else 0."""
        is_head = len(head) == HEADER_BYTES and head[0] == RECORD_HEAD and self._may_begin(head)
        return head[1] if is_head and head[1] not in self._layouts else 0

    def _has_one_error(self, head: bytes) -> bool:
        """Whether these bytes are a record's head with exactly one wrong byte."""
        errors = [byte not in accepted for byte, accepted in zip(head, _RECORD_HEAD_BYTES, strict=False)]
        return len(head) == HEADER_BYTES and sum(errors) == 1

    def _next_head(self, buffer: bytes, offset: int) -> int:
        """Return where the next record or reply may begin from this offset on; the buffer's end when nowhere."""
        match = self._head.search(buffer, offset)
        if match:
            return match.start()
        last = range(max(offset, len(buffer) - HEADER_BYTES + 1), len(buffer))
        return next((k for k in last if self._may_begin(buffer[k:])), len(buffer))


def _size_of_reply(buffer: bytes, offset: int, at_end: bool) -> int | None:
    """Return the length of the line at this offset [bytes]; 0 if there is none, None when undecided."""
    unprintable = _UNPRINTABLE.search(buffer, offset, offset + LONGEST_REPLY)
    if unprintable is None:
        return 0 if at_end or len(buffer) - offset >= LONGEST_REPLY else None
    stop = unprintable.start()
    end = buffer[stop : stop + 2]
    if end == b"\r\n":
        return stop + 2 - offset
    return None if end == b"\r" and not at_end else 0
