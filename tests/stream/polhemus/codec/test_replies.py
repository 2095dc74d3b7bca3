"""Replies as values and back, by the examples of docs/is900.md 6 and 7."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.stream.polhemus.codec.replies import (
    DeviceError,
    Emitter,
    GenlockReply,
    GeometryReply,
    IntegerReply,
    OutputList,
    ParsedReply,
    PredictionReply,
    SensitivityReply,
    StationRecord,
    StationStates,
    StatusRecord,
    SystemRecord,
    TrackingStatus,
    UnknownReply,
    parse_reply,
)

STATUS = bytes.fromhex("323153334642" + "20" * 9 + "342e32333031" + "20" + "4953393030564554" + "20" * 23 + "0d0a")
EXAMPLES: list[tuple[bytes, int, ParsedReply]] = [
    (STATUS, 55, StatusRecord("1", True, True, True, "4.2301", "IS900VET")),
    (
        b"21S3F0         4.2301 IS900VET" + b" " * 23 + b"\r\n",
        55,
        StatusRecord("1", False, False, False, "4.2301", "IS900VET"),
    ),
    (STATUS[:-3] + b"\r\n", 54, StatusRecord("1", True, True, True, "4.2301", "IS900VET", short=True)),
    (bytes.fromhex("32314f20322034 20310d0a"), 11, OutputList("1", (2, 4, 1))),
    (b"2AO40 21121 1\r\n", 15, OutputList("A", (40, 2, 11, 21, 1))),
    (bytes.fromhex("32316c313031300d0a"), 9, StationStates("1", (True, False, True, False))),
    (b"21l" + b"1100" + b"0" * 28 + b"\r\n", 37, StationStates(None, (True, True) + (False,) * 30)),
    (b"31Sg00\r\n", 8, SystemRecord("g")),
    (b"31Sg1E\r\n", 8, SystemRecord("g", True, True, True, True)),
    (b"32s024\r\n", 8, StationRecord("2", 2, 2)),
    (b"33p 0\r\n", 7, PredictionReply("3", 0)),
    (b"33p50\r\n", 7, PredictionReply("3", 50)),
    (b"31Q3\r\n", 6, SensitivityReply("1", 3)),
    (b"31U 5\r\n", 7, IntegerReply("1", "U", 5)),
    (b"31g3\r\n", 6, IntegerReply("1", "g", 3)),
    (b"32I12\r\n", 7, IntegerReply("2", "I", 12)),
    (b"31G0   0.00  0\r\n", 16, GenlockReply("0", 0.0, 0)),
    (
        b"31F      1    0.9144   -0.6096    0.0000   0.00   0.00   1.00   5001\r\n",
        70,
        Emitter(1, (0.9144, -0.6096, 0.0), (0.0, 0.0, 1.0), 5001),
    ),
    (
        b"31PT81L00X00X00X00X00X00X00X00X00X00X00  120  \r\n",
        48,
        TrackingStatus("TLXXXXXXXXXX", (8,) + (0,) * 11, (1,) + (0,) * 11, 120.0),
    ),
    (b"2 E*ERROR*O:,40,2,4,1*ERROR* EC -1*PS1  *FL1 *ST0\r\n", 51, DeviceError("O:,40,2,4,1", -1, 1, 1, 0)),
    (b"21A" + b"   0.00" * 8 + b" -12.50" + b"\r\n", 68, GeometryReply("1", "A", (0.0,) * 8 + (-12.5,))),
    (b"21G  90.00 -10.00   5.50\r\n", 26, GeometryReply("1", "G", (90.0, -10.0, 5.5))),
    (b"21H   0.00   0.00   0.00\r\n", 26, GeometryReply("1", "H", (0.0, 0.0, 0.0))),
    (b"21N   0.000   0.000  -4.500\r\n", 29, GeometryReply("1", "N", (0.0, 0.0, -4.5))),
    (b"21V" + b"   3.000" * 3 + b"  -3.000" * 3 + b"\r\n", 53, GeometryReply("1", "V", (3.0,) * 3 + (-3.0,) * 3)),
]


def test_a_device_after_power_on_has_the_flags_of_the_manual() -> None:
    assert StatusRecord().text_line().rstrip() == "21S3F0         4.2301 IS900VET"


@pytest.mark.parametrize(
    ("line", "length", "event"), EXAMPLES, ids=lambda x: x[:4].decode() if isinstance(x, bytes) else ""
)
def test_examples_are_parsed_and_formatted(line: bytes, length: int, event: ParsedReply) -> None:
    assert len(line) == length
    assert parse_reply(line) == event
    assert parse_reply(line[:-2]) == event
    assert event.line() == line


def test_an_emitter_with_a_wide_number_is_parsed_by_blanks() -> None:
    emitter = parse_reply(b"31F            1    0.9144   -0.6096    0.0000   0.00   0.00   1.00   5001\r\n")
    assert emitter == Emitter(1, (0.9144, -0.6096, 0.0), (0.0, 0.0, 1.0), 5001)


def test_the_last_decimal_of_an_emitter_is_not_its_identity() -> None:
    cut = b"31F      1    0.9144   -0.6096    0.0000   0.00   0.00   1.00"
    assert parse_reply(cut) == UnknownReply(cut)
    wide = Emitter(1, (0.9144, -0.6096, 0.0), (0.0, 0.0, 1.0), 1234567)
    assert parse_reply(wide.line()) == wide


def test_which_stations_are_active() -> None:
    one_station, all_stations = parse_reply(b"23l1010"), parse_reply(b"21l" + b"110000000001" + b"1" * 20)
    assert isinstance(one_station, StationStates)
    assert isinstance(all_stations, StationStates)
    assert one_station.stations == ("3",), "the first digit is that of station 3; then 2, 3 and 4"
    assert all_stations.stations == ("1", "2", "C")


def test_which_stations_are_lost() -> None:
    reply = parse_reply(b"31PT81L00XC0X00X00X00X00X00X00X00X00X00  180 G")
    assert isinstance(reply, TrackingStatus)
    assert (reply.rate_hz, reply.genlock, reply.received[2]) == (180.0, "G", 12)
    assert reply.lost == b"23456789ABC"


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"2",
        b"21S",
        b"21SXYZ",
        b"31SchAlg1",
        b"31CLM0",
        b"31EI192.168.0.1",
        b"51Tpassed",
        b"31P",
        b"21O2",
        b"21l1",
        STATUS[:40],
        b"31F 1 2 3",
        b"21A   0.00",
        b"\xff\xfe\x00",
        b"2 E*ERROR*",
    ],
)
def test_unknown_lines_are_kept_unchanged(line: bytes) -> None:
    assert parse_reply(line + b"\r\n") == UnknownReply(line)
    assert UnknownReply(line).line() == line + b"\r\n"


@given(st.binary(max_size=80))
def test_no_line_breaks_the_parser(line: bytes) -> None:
    parse_reply(line).line()


@given(st.sampled_from([line for line, _, _ in EXAMPLES]), st.integers(0, 68), st.binary(max_size=3))
def test_no_damage_breaks_the_parser(line: bytes, at: int, damage: bytes) -> None:
    reply = parse_reply(line[:at] + damage + line[at + len(damage) :])
    second_reply = parse_reply(
        reply.line()
    )  # may differ from `reply` where damage made a number too long for its columns
    assert parse_reply(second_reply.line()) == second_reply, "a formatted reply is parsed to itself"


def test_a_damaged_command_in_an_error_record_is_made_printable() -> None:
    reply = parse_reply(b"2 E*ERROR*\x00:,40,2,4,1*ERROR* EC -1*PS1  *FL1 *ST0\r\n")
    assert reply == DeviceError("?:,40,2,4,1", -1)
    assert parse_reply(reply.line()) == reply


def test_unprintable_characters_are_not_echoed() -> None:
    assert (
        DeviceError("O\x01\xff" + "x" * 500, -99).line()
        == b"2 E*ERROR*O??" + b"x" * 77 + b"*ERROR* EC -99*PS1  *FL1 *ST0\r\n"
    )


def test_both_widths_of_a_tip_offset_are_read() -> None:
    """The manual's text says 7 characters a number, its byte ranges 8 (docs/is900.md 14)."""
    for reply in (b"21N  30.00   0.00  -1.50", b"21N  30.000   0.000  -1.500"):
        assert parse_reply(reply) == GeometryReply("1", "N", (30.0, 0.0, -1.5))
