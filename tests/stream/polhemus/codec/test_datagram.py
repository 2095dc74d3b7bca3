"""The UDP packet of docs/is900.md 9, by its example and under damage."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.datagram import (
    DATAGRAM_FORMAT,
    DATAGRAM_LIST,
    Datagram,
    DatagramDecoder,
    parse_datagram,
    split_packets,
)
from harness.stream.polhemus.codec.decoder import Garbage, RecordRun
from harness.stream.polhemus.codec.reader import ByteCapture, FrameReader, WireFormat
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records, from_yaw_pitch_roll_deg

EXAMPLE = bytes.fromhex(
    "ff010703 0401ff05 7fff000000000000 0000b442 000020c1 0000b040 0000803f 000000bf 0000c03f 2b874541"
)
PARSED_EXAMPLE = Datagram(
    sequence=7,
    model=4,
    station=1,
    quality=255,
    buttons=5,
    analogue=(127, 255, 0, 0, 0, 0, 0, 0),
    yaw_pitch_roll_deg=(90.0, -10.0, 5.5),
    position_m=(1.0, -0.5, 1.5),
    time_s=struct.unpack("<f", struct.pack("<f", 12.3455))[0],
)


def test_the_example_is_parsed_and_formatted() -> None:
    assert len(EXAMPLE) == 44
    assert parse_datagram(EXAMPLE) == PARSED_EXAMPLE
    assert PARSED_EXAMPLE.packet() == EXAMPLE


def test_the_time_is_optional() -> None:
    without = Datagram(*(getattr(PARSED_EXAMPLE, name) for name in list(Datagram.__dataclass_fields__)[:-1]))
    assert len(without.packet()) == 40
    assert parse_datagram(without.packet()) == without


@pytest.mark.parametrize("at", range(2, 44))
@pytest.mark.parametrize("bit", range(8))
def test_a_flipped_bit_is_detected_except_in_the_sequence_number(at: int, bit: int) -> None:
    damaged = bytearray(EXAMPLE)
    damaged[at] ^= 1 << bit
    assert (parse_datagram(bytes(damaged)) is None) == (at != 2), "the sum does not cover the sequence number"


@given(st.binary(max_size=60))
def test_random_bytes_are_no_packet_or_keep_their_length(data: bytes) -> None:
    parsed = parse_datagram(data)
    assert parsed is None or len(parsed.packet()) == len(data)


@pytest.mark.parametrize("packet", [EXAMPLE[:-1], EXAMPLE + b"\0", b"", b"\xff\x02" + EXAMPLE[2:]])
def test_other_lengths_and_camera_data_are_refused(packet: bytes) -> None:
    assert parse_datagram(packet) is None


RATE_HZ = 50.0
WITHOUT_TIME = tuple(code for code in DATAGRAM_LIST if code != 21)


def packet(station: int, time_s: float | None, x: float = 1.0, quality: int = 255, sequence: int = 0) -> bytes:
    values = {"sequence": sequence, "model": 4, "station": station, "quality": quality, "buttons": 5}
    angles, position = (10.0 * station, -10.0, 5.5), (x, 0.25 * station, 1.5)
    return Datagram(
        **values, analogue=(127, 255, *[0] * 6), yaw_pitch_roll_deg=angles, position_m=position, time_s=time_s
    ).packet()


def stamp_s(number: int, station: int) -> float:
    return 100.0 + number / RATE_HZ + 0.004 * station


def rounds(count: int, stations: int = 3) -> list[list[bytes]]:
    return [
        [packet(s, stamp_s(n, s), x=1.0 + 0.01 * n, sequence=n * stations + s) for s in range(1, stations + 1)]
        for n in range(count)
    ]


def read(packets: list[tuple[float, bytes]], items: tuple[int, ...] = DATAGRAM_LIST) -> list[TrackerFrame]:
    wire = WireFormat(("a", "b", "c"), RATE_HZ, items, DATAGRAM_FORMAT, datagrams=True)
    reader, frames = FrameReader(wire), list[TrackerFrame]()
    for received_s, data in packets:
        frames += reader.feed(data, received_s)
    return frames + reader.finish()


def test_frames_are_those_of_a_serial_line_with_the_same_content() -> None:
    """Serial records of the same numbers, in centimetres and milliseconds: equal within single precision."""
    received = [(500.0 + n / RATE_HZ, b"".join(one)) for n, one in enumerate(rounds(20))]
    frames = read(received)
    number, station = np.repeat(np.arange(20), 3), np.tile(np.arange(1, 4), 20)
    values = RecordValues(
        np.array([stamp_s(int(n), int(s)) for n, s in zip(number, station, strict=True)]),
        np.stack([1.0 + 0.01 * number, 0.25 * station, np.full(60, 1.5)], axis=1),
        from_yaw_pitch_roll_deg(np.stack([10.0 * station, np.full(60, -10.0), np.full(60, 5.5)], axis=1)),
        np.ones(60),
    )
    items = (40, 2, 4, 21, 1)
    table = encode_records(items, 48 + station.astype(np.uint8), values, RecordFormat())
    data = [table[3 * n : 3 * n + 3].tobytes() for n in range(20)]
    ends, times = np.cumsum([len(part) for part in data]), np.array([now for now, _ in received])
    reader = FrameReader(WireFormat(("a", "b", "c"), RATE_HZ, items))
    serial = [*reader.feed_all(ByteCapture(b"".join(data), ends, times)), *reader.finish()]
    assert len(frames) == len(serial) == 20
    for one, other in zip(frames, serial, strict=True):
        assert one.received_s == other.received_s
        np.testing.assert_allclose(one.measured_s, other.measured_s, atol=1e-5)
        np.testing.assert_allclose(one.position_m, other.position_m, atol=1e-6)
        np.testing.assert_allclose(one.tracker_from_station, other.tracker_from_station, atol=1e-6)
        assert (one.position_valid == other.position_valid).all()
        assert not one.suspect.any()


def test_a_lost_packet_is_an_invalid_row_and_a_lost_station_has_no_position() -> None:
    parts = rounds(6)
    del parts[2][1]
    parts[4][0] = packet(1, stamp_s(4, 1), quality=0)
    frames = read([(500.0 + n / RATE_HZ, b"".join(one)) for n, one in enumerate(parts)])
    assert [frame.position_valid.tolist() for frame in frames] == [
        [True] * 3, [True] * 3, [True, False, True], [True] * 3, [False, True, True], [True] * 3,
    ]  # fmt: skip


@pytest.mark.parametrize("time", [True, False])
@pytest.mark.parametrize("position", [2, *range(0, 40, 3)])
def test_damage_costs_its_packet_alone(time: bool, position: int) -> None:
    """Packets of either length, read at once."""
    good = [packet(1 + n % 3, float(n) if time else None, x=0.1 * n) for n in range(9)]
    bad = bytearray(good[4])
    bad[position] ^= 0x55
    decoder = DatagramDecoder(DATAGRAM_LIST if time else WITHOUT_TIME, b"123")
    events = decoder.feed(b"".join([*good[:4], bytes(bad), *good[5:]]))
    records = sum(len(event.table) for event in events if isinstance(event, RecordRun))
    garbage = sum(event.size for event in events if isinstance(event, Garbage))
    assert (records, garbage) == ((9, 0) if position == 2 else (8, len(bad)))


def test_other_stations_and_rubbish_are_no_records() -> None:
    decoder = DatagramDecoder(DATAGRAM_LIST, b"13")
    data = b"rubbish" + packet(1, 1.0) + packet(2, 1.0) + packet(3, 1.0) + packet(0, 1.0) + packet(13, 1.0)
    events = decoder.feed(data)
    stations = [chr(c) for event in events if isinstance(event, RecordRun) for c in event.table["station"]]
    assert stations == ["1", "3"]
    assert sum(event.size for event in events if isinstance(event, Garbage)) == 7 + 2 * 44
    assert [one.station for one in split_packets(data)] == [1, 2, 3]


def test_packets_without_a_time_are_placed_by_the_hosts_clock() -> None:
    parts = [(500.0 + n / RATE_HZ + 0.004 * s, packet(s, None, x=1.0 + 0.01 * n)) for n in range(6) for s in (1, 2, 3)]
    frames = read(parts, WITHOUT_TIME)
    assert len(frames) == 6
    assert all(np.isnan(frame.measured_s).all() and frame.position_valid.all() for frame in frames)


@given(st.lists(st.one_of(st.binary(max_size=60), st.sampled_from([packet(1, 1.0), packet(2, None)])), max_size=8))
def test_any_bytes_are_packets_or_garbage(parts: list[bytes]) -> None:
    data = b"".join(parts)
    events = DatagramDecoder(DATAGRAM_LIST, b"123456789ABC").feed(data)
    offset = 0
    for event in events:
        assert event.offset == offset
        offset += event.nbytes if isinstance(event, RecordRun) else event.size if isinstance(event, Garbage) else 0
    assert offset == len(data)
