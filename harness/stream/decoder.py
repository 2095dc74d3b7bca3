"""Bytes in, events out: finds records and reply lines in what an IS-900 sends, whatever the pieces it comes in.

A record is taken where its header, its length and its terminator agree; a reply line starts with '2' or '3' and ends
with CR LF (docs/is900.md section 6). Anything else is skipped a byte at a time and counted, so one bad byte costs
the records that it touches. What cannot be seen: a changed bit inside a float or a station character that leaves a
well-formed record; the wire has no checksum, and `assemble` doubts what it can.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harness.stream.records import LIST, STATIONS, looks_right, record_type

LONGEST_REPLY = 256
"""Bytes; the longest known reply has 70."""


@dataclass(frozen=True, eq=False)
class Records:
    """A run of whole records, as they followed each other."""

    records: NDArray[np.void]
    """(N,) of `records.record_type`."""
    end: NDArray[np.int64]
    """(N,) bytes of the whole stream up to the end of each."""


@dataclass(frozen=True)
class Reply:
    """A line that is no data: status, output list, error; without its CR LF."""

    text: bytes


@dataclass(frozen=True)
class Skipped:
    """Bytes that belong to nothing."""

    count: int


Event = Records | Reply | Skipped


class Decoder:
    """One stream. Needs a list that ends in CR LF (item 1); keeps less than one record or reply between calls."""

    def __init__(self, items: Sequence[int] = LIST) -> None:
        self._type = record_type(items)
        self._rest = b""
        self._read = 0

    def feed(self, data: bytes) -> list[Event]:
        """Everything that `data` completes, in order. Any split of a stream gives the same records and replies."""
        buffer = self._rest + data
        events = list(self._events(buffer))
        self._rest = buffer[self._at :]
        self._read += self._at
        return _merged(events)

    def _events(self, buffer: bytes) -> Iterator[Event]:
        size, self._at = self._type.itemsize, 0
        while self._at < len(buffer):
            at = self._at
            records = self._run(buffer, at)
            if len(records):
                ends = self._read + at + size * np.arange(1, len(records) + 1)
                self._at += size * len(records)
                yield Records(records, ends)
            elif buffer[at] in b"23":
                end = buffer.find(b"\r\n", at, at + LONGEST_REPLY)
                text = buffer[at : end if end >= 0 else at + LONGEST_REPLY].removesuffix(b"\r")
                if _printable(text) and end >= 0:
                    self._at = end + 2
                    yield Reply(text)
                elif _printable(text) and len(text) < LONGEST_REPLY - 1:
                    return
                else:
                    self._at += 1
                    yield Skipped(1)
            elif self._may_begin(buffer[at : at + 3]) and len(buffer) - at < size:
                return
            else:
                self._at += 1
                yield Skipped(1)

    def _run(self, buffer: bytes, at: int) -> NDArray[np.void]:
        count = (len(buffer) - at) // self._type.itemsize
        if not count or buffer[at] != 0x30:
            return np.empty(0, self._type)
        one = np.frombuffer(buffer, self._type, 1, at)
        if not looks_right(one)[0]:
            return one[:0]
        records = np.frombuffer(buffer, self._type, count, at)
        right = looks_right(records)
        return records if right.all() else records[: int(np.argmin(right))]

    @staticmethod
    def _may_begin(start: bytes) -> bool:
        return start[0] == 0x30 and (len(start) < 2 or start[1] in STATIONS) and (len(start) < 3 or start[2] == 0x20)


def _printable(text: bytes) -> bool:
    return all(0x20 <= byte < 0x7F for byte in text)


def _merged(events: list[Event]) -> list[Event]:
    """Neighbouring skips as one."""
    out: list[Event] = []
    for event in events:
        if isinstance(event, Skipped) and out and isinstance(out[-1], Skipped):
            out[-1] = Skipped(out[-1].count + event.count)
        else:
            out.append(event)
    return out
