"""Commands as bytes and back: the framing of docs/is900.md 3, and what real clients send (11)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.stream.codec import commands
from harness.stream.codec.commands import LONGEST_LINE, Command, CommandReader, station_command


def read(data: bytes) -> list[bytes]:
    return [command.line for command in CommandReader().feed(data)]


@pytest.mark.parametrize(
    ("data", "lines"),
    [
        (b"fCMT\rMZ\r", [b"f", b"C", b"MT", b"MZ"]),
        (b"cS", [b"c", b"S"]),
        (b"O1,2,11,0\rO2,2,11,0\r", [b"O1,2,11,0", b"O2,2,11,0"]),
        (b"x0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\r", [b"x0.2,0.2,0.8,0.8", b"v0.2,0.2,0.8,0.8"]),
        (b"c*resetMS\r\n", [b"c", b"*resetMS"]),
        (b"fuC\x11SMG\r\n", [b"f", b"u", b"C", b"\x11", b"S", b"MG"]),
        (
            b"cFUSl*\nMCF\nMP\nO1,40,2,4,1\n\rO1\r",
            [b"c", b"F", b"U", b"S", b"l*", b"MCF", b"MP", b"O1,40,2,4,1", b"O1"],
        ),
        (b"l1,1\r\nR1\r\nb1\r\nMp1,0\r\nMF1,0\r\nMQ1,3\r\n", [b"l1,1", b"R1", b"b1", b"Mp1,0", b"MF1,0", b"MQ1,3"]),
        (b"tY\x19c", [b"\x19", b"c"]),
        (b"\r\n\r\n\n", []),
        (b"M\x13S\r", [b"\x13", b"MS"]),
        (b"W\x0b", [b"W", b"\x0b"]),
    ],
    ids=lambda given: given[:8].decode("latin-1") if isinstance(given, bytes) else "",
)
def test_commands_of_real_clients_are_parsed(data: bytes, lines: list[bytes]) -> None:
    assert read(data) == lines


@given(
    st.lists(st.sampled_from([b"c", b"S", b"\x19", b"\x0b", b"O1,2\r", b"MZ\r\n", b"\n", b"M", b"l*", b"\xff"])),
    st.data(),
)
def test_any_split_gives_the_same_commands(parts: list[bytes], choose: st.DataObject) -> None:
    data = b"".join(parts)
    cut = choose.draw(st.integers(0, len(data)))
    reader = CommandReader()
    assert reader.feed(data[:cut]) + reader.feed(data[cut:]) == CommandReader().feed(data)


def test_an_endless_line_is_truncated_and_the_next_is_read() -> None:
    reader = CommandReader()
    out: list[Command] = []
    for _ in range(1000):
        out += reader.feed(b"x" * 1000)
    assert out == []
    assert reader.feed(b"\rMZ\r") == [Command(b"x" * LONGEST_LINE, cut=True), Command(b"MZ")]


@pytest.mark.parametrize(
    ("command", "expected_bytes"),
    [
        (station_command("O", "1", (40, 2, 11, 21, 1)), b"O1,40,2,11,21,1\r\n"),
        (station_command("O", "A"), b"OA\r\n"),
        (station_command("l", "2", [False]), b"l2,0\r\n"),
        (station_command("N", "1", (0, -2.5, 30.0), 3), b"N1,0.000,-2.500,30.000\r\n"),
    ],
)
def test_commands_are_those_of_the_manuals(command: bytes, expected_bytes: bytes) -> None:
    assert command == expected_bytes
    assert read(command) == [expected_bytes[:-2]]


def test_immediate_commands_need_no_terminator() -> None:
    for byte in commands.IMMEDIATE_LETTERS + commands.CONTROL_CHARACTERS:
        assert CommandReader().feed(bytes([byte])) == [Command(bytes([byte]))]
        assert Command(bytes([byte])).immediate
    assert not Command(b"MZ").immediate
