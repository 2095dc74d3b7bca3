"""Recognition and parsing of the records of one output list, by a regular expression of their fixed bytes."""

import re

import numpy as np

from harness.stream.codec import ascii_records as text
from harness.stream.codec.items import OutputItem, record_size, record_type, resolve_items, terminator
from harness.stream.codec.records import RecordFormat, Table


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
        return text.parse_records(self.items, raw, self._stylus_bytes)

    def _expression(self, item: OutputItem) -> bytes:
        if item.fixed:
            return re.escape(item.fixed)
        if item.sevens:
            return rb"[\x80-\xff][\x00-\x7f]{%d}" % (item.count - 1)
        if item.width and not self._binary:
            return text.item_pattern(item)
        return b".{%d}" % np.dtype((item.kind, item.count)).itemsize


def record_head_pattern(stations: bytes) -> bytes:
    """Return a regular expression of a record's head.

    A blank is the status of an IS-900, a letter that of a Fastrak.
    """
    return b"0[%b][ A-Za-z]" % stations
