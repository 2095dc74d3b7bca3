"""Bytes in, events out: finds data records and replies in the stream of an IS-900, without input or output.

There is no checksum and no escape: a record is known by its header and its length, and by the CR LF (or space) that
its output list may end in. While in step, a record counts once its last byte is there. Out of step, the header of
whatever follows must be there too; so it must for lists that end in nothing fixed. Every decision depends on the
bytes alone, never on how they were cut into chunks. Between records, lines that start with 2, 3 or 5 are replies.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools
from harness.stream.items import HEAD, record_type, terminator
from harness.stream.records import Table

LONGEST_REPLY = 256
"""No reply in the sources is half as long [bytes]."""
_REPLY_HEAD = re.compile(rb"[235][ 1-9A-Ca-c]")
_UNPRINTABLE = re.compile(rb"[^ -~]")
_CANDIDATE = re.compile(rb"[0235]")
_STATUS: Bools = np.zeros(256, bool)
_STATUS[[ord(" "), *range(ord("A"), ord("Z") + 1), *range(ord("a"), ord("z") + 1)]] = True


@dataclass(frozen=True, eq=False)
class Records:
    """A run of records of one output list, without a byte between them."""

    offset: int
    """Bytes of the stream before the run."""
    items: tuple[int, ...]
    table: Table


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


Event = Records | Reply | Garbage


def joined(events: Iterable[Event]) -> list[Event]:
    """The same events with neighbours made one wherever they touch: what any split of the bytes gives alike."""
    out: list[Event] = []
    for event in events:
        last = out[-1] if out else None
        if isinstance(event, Garbage) and isinstance(last, Garbage) and last.offset + last.size == event.offset:
            out[-1] = Garbage(last.offset, last.size + event.size)
        elif (
            isinstance(event, Records)
            and isinstance(last, Records)
            and last.items == event.items
            and last.offset + last.table.nbytes == event.offset
        ):
            out[-1] = Records(last.offset, last.items, np.concatenate([last.table, event.table]))
        else:
            out.append(event)
    return out


@dataclass(frozen=True, eq=False)
class _Layout:
    items: tuple[int, ...]
    stations: Bools
    """(256,) characters of the stations that send this list."""

    @property
    def size(self) -> int:
        return int(record_type(self.items).itemsize)

    @property
    def end(self) -> bytes:
        return terminator(self.items)


class Decoder:
    """Keeps at most one undecided record or reply between calls, whatever comes in."""

    def __init__(self, lists: Mapping[int, tuple[int, ...]]) -> None:
        """`lists` is the output list of each station, by its character's code."""
        self._layouts: dict[int, _Layout] = {}
        for items in set(lists.values()):
            stations = np.zeros(256, bool)
            stations[[station for station, own in lists.items() if own == items]] = True
            layout = _Layout(items, stations)
            self._layouts |= {station: layout for station, own in lists.items() if own == items}
        self._buffer = b""
        self._offset = 0
        """Bytes of the stream before the buffer."""
        self._in_step = False

    @property
    def pending(self) -> int:
        """Bytes that wait for more."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[Event]:
        """What became certain with these bytes."""
        return self._decode(self._buffer + data, ended=False)

    def finish(self) -> list[Event]:
        """What is left when nothing more will come: the end stands for the header of the next record."""
        return self._decode(self._buffer, ended=True)

    def _decode(self, buffer: bytes, ended: bool) -> list[Event]:
        events: list[Event] = []
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
        return joined(events)

    def _run(self, buffer: bytes, at: int, events: list[Event]) -> int:
        """Take as many whole records of one list as follow each other in step; the bytes they have."""
        layout = self._layouts.get(buffer[at + 1]) if self._in_step and at + 1 < len(buffer) else None
        if layout is None or not layout.end:
            return 0
        count = (len(buffer) - at) // layout.size
        table = np.frombuffer(buffer, record_type(layout.items), count, at)
        sound = (table["head"] == HEAD) & layout.stations[table["station"]] & _STATUS[table["status"]]
        raw = np.frombuffer(buffer, np.uint8, count * layout.size, at).reshape(count, layout.size)
        sound &= np.all(raw[:, layout.size - len(layout.end) :] == np.frombuffer(layout.end, np.uint8), axis=1)
        whole = count if sound.all() else int(np.argmin(sound))
        if whole:
            events.append(Records(self._offset + at, layout.items, table[:whole]))
        return whole * layout.size

    def _single(self, buffer: bytes, at: int, events: list[Event], ended: bool) -> int:
        """Take one record, reply or piece of garbage; the bytes it has, 0 when more are needed to tell."""
        size = self._size_of(buffer, at, ended)
        if size is None:
            return 0
        if size == 0:
            self._in_step = False
            found = _CANDIDATE.search(buffer, at + 1)
            size = (found.start() if found else len(buffer)) - at
            events.append(Garbage(self._offset + at, size))
            return size
        self._in_step = True
        if buffer[at] == HEAD:
            items = self._layouts[buffer[at + 1]].items
            events.append(Records(self._offset + at, items, np.frombuffer(buffer, record_type(items), 1, at)))
        else:
            events.append(Reply(self._offset + at, buffer[at : at + size - 2]))
        return size

    def _size_of(self, buffer: bytes, at: int, ended: bool) -> int | None:
        """Bytes of the record or reply at this place; 0 for neither, None when it cannot be told yet."""
        if buffer[at] == HEAD:
            return self._size_of_record(buffer, at, ended)
        head = buffer[at : at + 2]
        if len(head) == 2 and not _REPLY_HEAD.match(head):
            return 0
        if len(head) == 1 and not _CANDIDATE.match(head):
            return 0
        broken = _UNPRINTABLE.search(buffer, at, at + LONGEST_REPLY)
        if broken is None:
            return 0 if ended or len(buffer) - at >= LONGEST_REPLY else None
        stop = broken.start()
        end = buffer[stop : stop + 2]
        if end == b"\r\n" and stop - at >= 3:
            return stop + 2 - at
        return None if end == b"\r" and not ended else 0

    def _size_of_record(self, buffer: bytes, at: int, ended: bool) -> int | None:
        header = buffer[at + 1 : at + 3]
        layout = self._layouts.get(header[0]) if header else None
        if (header and layout is None) or (len(header) == 2 and not _STATUS[header[1]]):
            return 0
        if layout is None or len(buffer) - at < layout.size:
            return 0 if ended else None
        after = at + layout.size
        if not buffer.endswith(layout.end, at, after):
            return 0
        if self._in_step and layout.end:
            return layout.size
        if after == len(buffer):
            return layout.size if ended else None
        return layout.size if _CANDIDATE.match(buffer, after) else 0
