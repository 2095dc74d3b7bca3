"""Bytes in, events out: any split, any damage, any garbage."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.stream.polhemus.codec.decoder import (
    Decoder,
    DecoderEvent,
    Garbage,
    RecordRun,
    Reply,
    merge_adjacent,
)
from harness.stream.polhemus.codec.items import STANDARD_LIST
from tests.stream.wire import RECORD, device_bytes, stamps_s

STATUS = b"21S3FB         4.2301 IS900VET" + b" " * 23 + b"\r\n"
ERROR = b"2 E*ERROR*O:,40,2,4,1*ERROR* EC -1*PS1  *FL1 *ST0\r\n"
REPLIES = [
    STATUS,
    ERROR,
    b"21O 2 4 1\r\n",
    b"21l1010\r\n",
    b"31Sg00\r\n",
    b"31G0   0.00  0\r\n",
    b"31PT81L00X00X00X00X00X00X00X00X00X00X00  120  \r\n",
    b"31F      1    0.9144   -0.6096    0.0000   0.00   0.00   1.00   5001\r\n",
    b"33p 0\r\n",
]
"""Examples of docs/is900.md 6 and 7."""


def make_decoder() -> Decoder:
    return Decoder(dict.fromkeys(b"1234", STANDARD_LIST))


def decode_split(data: bytes, cuts: tuple[int, ...] = ()) -> list[DecoderEvent]:
    """Return all events in these bytes, fed in chunks that end at the cuts."""
    decoder, events = make_decoder(), []
    for start, stop in zip((0, *cuts), (*cuts, len(data)), strict=True):
        events += decoder.feed(data[start:stop])
    return merge_adjacent(events + decoder.finish())


def record_bytes(events: list[DecoderEvent]) -> list[bytes]:
    out = []
    for event in events:
        if isinstance(event, RecordRun):
            out += [event.table[k : k + 1].tobytes() for k in range(len(event.table))]
    return out


def split_records(data: bytes) -> list[bytes]:
    return [data[k : k + RECORD] for k in range(0, len(data), RECORD)]


def comparable(events: list[DecoderEvent]) -> list[object]:
    """Return the events in a form that can be compared."""
    return [(e.offset, e.items, e.table.tobytes()) if isinstance(e, RecordRun) else e for e in events]


def test_records_are_decoded_unchanged() -> None:
    data = device_bytes(stamps_s(50))
    events = decode_split(data)
    assert len(events) == 1
    assert record_bytes(events) == split_records(data)


def test_a_record_is_returned_with_its_last_byte() -> None:
    """In step, no record waits for the next one."""
    data, decoder = device_bytes(stamps_s(2)), make_decoder()
    decoder.feed(data[: 2 * RECORD])
    for end in range(3 * RECORD, len(data) + 1, RECORD):
        assert record_bytes(decoder.feed(data[end - RECORD : end - 1])) == []
        assert record_bytes(decoder.feed(data[end - 1 : end])) == [data[end - RECORD : end]]
        assert decoder.pending == 0


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_any_split_of_any_bytes_gives_the_same_events(choose: st.DataObject) -> None:
    parts = st.sampled_from(
        [*split_records(device_bytes(stamps_s(2))), *REPLIES[:4], b"0", b"01 ", b"2", b"\r\n", b"31"]
    )
    data = b"".join(choose.draw(st.lists(st.one_of(parts, st.binary(max_size=50)), max_size=8)))
    cuts = choose.draw(st.lists(st.integers(0, len(data)), max_size=6).map(sorted).map(tuple))
    events = decode_split(data, cuts)
    assert comparable(events) == comparable(decode_split(data))
    covered = sum(
        e.table.nbytes if isinstance(e, RecordRun) else e.size if isinstance(e, Garbage) else len(e.line) + 2
        for e in events
    )
    assert covered == len(data), "every byte belongs to exactly one event"


@pytest.mark.parametrize("line", REPLIES, ids=lambda line: line[:4].decode())
def test_replies_between_records_are_found(line: bytes) -> None:
    data = split_records(device_bytes(stamps_s(3)))
    events = decode_split(data[0] + line + b"".join(data[1:5]) + line + line + b"".join(data[5:]))
    assert record_bytes(events) == data
    assert [event.line + b"\r\n" for event in events if isinstance(event, Reply)] == [line] * 3
    assert not [event for event in events if isinstance(event, Garbage)]


def test_a_burst_of_rubbish_costs_the_records_that_it_touches(rng: np.random.Generator) -> None:
    missing = 0
    for trial in range(200):
        data = split_records(device_bytes(stamps_s(5), seed=trial))
        garbage = rng.integers(0, 256, int(rng.integers(1, 200)), dtype=np.uint8).tobytes()
        decoded = record_bytes(decode_split(b"".join(data[:8]) + garbage + b"".join(data[8:])))
        missing += sum(record not in decoded for record in data)
    assert missing <= 1


def test_stations_may_have_different_lists() -> None:
    short_record, long_record = b"01 " + bytes(range(12)) + b" ", split_records(device_bytes(stamps_s(1)))[1]
    decoder = Decoder({ord("1"): (2, 0), ord("2"): STANDARD_LIST})
    events = merge_adjacent(
        [*decoder.feed(short_record + long_record + long_record + short_record + long_record), *decoder.finish()]
    )
    assert [(e.items, len(e.table)) for e in events if isinstance(e, RecordRun)] == [
        ((2, 0), 1),
        (STANDARD_LIST, 2),
        ((2, 0), 1),
        (STANDARD_LIST, 1),
    ]
