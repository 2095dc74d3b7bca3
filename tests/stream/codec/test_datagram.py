"""The UDP packet of docs/is900.md 9, by its example and under damage."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.stream.codec.datagram import Datagram, parse_datagram

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
