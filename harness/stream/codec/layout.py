"""How the records of an output list are recognised and read: a regular expression of all that is fixed in them."""

import re

import numpy as np

from harness.stream.codec import ascii_records as text
from harness.stream.codec.items import OutputItem, record_size, record_type, resolve_items, terminator
from harness.stream.codec.records import RecordFormat, Table


class RecordLayout:
    """Records of one list, sent by these stations with these settings."""

    def __init__(self, items: tuple[int, ...], stations: bytes, settings: RecordFormat, next_head: bytes) -> None:
        """`next_head` is a regular expression of what may follow a record."""
        self.items = items
        self.size = record_size(items, settings.binary, settings.stylus_bytes)
        self.end = terminator(items)
        """What every record ends in; empty where nothing is fixed."""
        self._binary, self._stylus_bytes = settings.binary, settings.stylus_bytes
        own = resolve_items(items, settings.stylus_bytes)
        record = record_head_pattern(stations) + b"".join(self._expression(item) for item in own)
        ahead = b"" if self.end else b"(?=%b)" % next_head
        self.record = re.compile(record, re.DOTALL)
        self.run = re.compile(b"(?:%b%b)*+" % (record, ahead), re.DOTALL)
        """As many whole records as follow each other; where nothing fixed ends them, a head behind each."""

    def table(self, buffer: bytes, at: int, count: int) -> Table:
        """Records (N,) that begin at this place and match `record`."""
        if self._binary:
            return np.frombuffer(buffer, record_type(self.items, self._stylus_bytes), count, at)
        raw = np.frombuffer(buffer, np.uint8, count * self.size, at).reshape(count, self.size)
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
    """A regular expression of a record's head: a blank is an IS-900's status, a letter a Fastrak's."""
    return b"0[%b][ A-Za-z]" % stations
