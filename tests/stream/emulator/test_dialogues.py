"""The start-up dialogues of docs/is900.md 11, byte for byte, with the device alone.

Times between the bytes are those that the clients were observed to leave. Simulated clients on real ports are in
tests/clients.
"""

import pytest

from harness.stream.codec.items import record_size
from harness.stream.emulator.config import EmulatorConfig
from tests.stream.emulator.played import DeviceSession


def split_records(data: bytes, items: tuple[int, ...]) -> list[bytes]:
    """Split binary records of this list, and check their heads."""
    length = record_size(items)
    assert data
    assert len(data) % length == 0
    records_found = [data[at : at + length] for at in range(0, len(data), length)]
    assert all(record[:1] == b"0" and record[2:3] == b" " for record in records_found)
    return records_found


def test_vrpn() -> None:
    """Four stations, `O...,2,11,0`, inches by default; `x` and `v` have no reply (11.1)."""
    session = DeviceSession()
    assert session.send(b"c") == b""
    status = session.send(b"S", after_s=4.0)
    assert (len(status), status[:1], status[-1:]) == (55, b"2", b"\n")
    for station in b"1234":
        assert session.send(b"O%c,2,11,0\r" % station, after_s=0.05) == b""
    assert session.send(b"x0.2,0.2,0.8,0.8\r", after_s=1.0) == b""
    assert session.send(b"v0.2,0.2,0.8,0.8\r", after_s=1.0) == b""
    session.send(b"fC", after_s=1.0)
    records_found = split_records(session.wait(1.0), (2, 11, 0))
    assert len(records_found) == pytest.approx(4 * 50, abs=8)
    assert {record[1:2] for record in records_found} == {b"1", b"2", b"3", b"4"}
    assert {record[-1:] for record in records_found} == {b" "}


def test_vrpn_with_is900time_and_a_wand() -> None:
    """`MT` and `MZ` follow `fC` in one read; lists are sent once before the reset too (11.1)."""
    wand, plain = b"O1,2,11,21,22,23,0\r", b"O2,2,11,21,0\rl3,0\rl4,0\r"
    session = DeviceSession()
    session.send(b"fC")
    session.wait(0.5)  # left streaming by the previous client
    session.send(wand + plain)
    session.send(b"c")
    assert session.wait(2.0) == b""
    assert len(session.send(b"S", after_s=2.0)) == 55
    assert session.send(wand + plain + b"x0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\r", after_s=1.0) == b""
    received = session.send(b"fCMT\rMZ\r", after_s=2.0) + session.wait(0.5)
    assert received[:3] == b"01 "
    first, second = record_size((2, 11, 21, 22, 23, 0)), record_size((2, 11, 21, 0))
    assert len(received) % (first + second) in (0, first)
    assert received[first : first + 3] == b"02 "


def test_vrpn_resets_a_device_that_does_not_answer() -> None:
    """CR, 19 and `c` come 2 s apart, then a wait of 20 s. The last attempts have letters without CR (11.1)."""
    for characters in (b"\r\x19c", b"\rt\x19c", b"\rYt\x19c"):
        session = DeviceSession(EmulatorConfig(restart_s=10.0))
        for byte in characters:
            assert session.send(bytes([byte]), after_s=2.0) == b""
        assert len(session.send(b"S", after_s=20.0)) == 55


def test_intersense_library() -> None:
    """The first `MS` is joined to letters for another product; lists must be reported as they were set (11.2)."""
    session = DeviceSession()
    for _ in range(3):
        session.send(b"c*reset", after_s=0.15)
    assert not session.send(b"MS\r\n").startswith(b"31S")
    assert session.send(b"c") == b""
    assert session.send(b"MS\r\n", after_s=0.15) == b"31Sg08\r\n"
    assert session.send(b"S")[15:32] == b"4.2301 IS900VET  "
    assert session.send(b"c") == b""
    for station in b"12345678":
        assert session.send(b"O%c,2,4,1\r\n" % station) == b""
        assert session.send(b"O%c\r\n" % station) == b"2%cO 2 4 1\r\n" % station
    assert session.send(b"O1,2,4,21,22,23,40,1\r\nO1\r\n") == b"21O 2 421222340 1\r\n"
    assert session.send(b"O1,2,4,1\r\nl*\r\n") == b"21l1111" + b"0" * 28 + b"\r\n"
    session.send(b"fu")
    session.send(b"C\x11")
    session.device.receive(b"SMG\r\n", session.now_s + 0.5)
    messages = [message for message in session.device.messages(session.now_s + 1.0) if not message.station]
    assert [message.data[:3] for message in messages] == [b"21S", b"31G"]
    assert messages[0].data[3:6] == b"3FB"
    session.now_s += 1.0
    session.send(b"c")
    assert session.wait(1.0) == b""


def test_freevr() -> None:
    """Lines end in LF or LF CR; data are polled by `P`, in ASCII (11.3)."""
    session = DeviceSession()
    messages = session.send(b"cFUSl*\nMCF\nMP\n").split(b"\r\n")
    assert [line[:3] for line in messages[:2]] == [b"21S", b"21l"]
    assert {(line[:3], len(line)) for line in messages[2:-2]} == {(b"31F", 68)}
    assert (messages[-2][:3], len(messages[-2])) == (b"31P", 46)
    for station in b"123456789ABC":
        assert session.send(b"O%c,40,2,4,1\n\r" % station) == b""
        assert session.send(b"O%c\r" % station) == b"2%cO40 2 4 1\r\n" % station
    for _ in range(3):
        lines = session.send(b"P", after_s=0.1).split(b"\r\n")
        assert [(line[:3], len(line)) for line in lines] == [(b"0%c " % s, 49) for s in b"1234"] + [(b"", 0)]
        assert lines[0][3:7] == b" 255"
        assert len(session.send(b"MP\n")) == 48


def test_vrui() -> None:
    """The client resets with 19, configures every station, then streams binary records with CR LF (11.3)."""
    session = DeviceSession()
    assert session.send(b"\x19") == b""
    assert len(session.send(b"cS\r\nl*\r\n", after_s=15.0)) == 55 + 37
    for station in b"12":
        for line in (b"l%c,1", b"R%c", b"b%c", b"N%c,0.0,0.0,0.0", b"Mp%c,0", b"MF%c,2", b"MQ%c,3"):
            assert session.send(line % station + b"\r\n") == b""
        assert session.send(b"O%c,2,4,22,23,1\r\n" % station) == b""
    assert session.send(b"l3,0\r\nl4,0\r\nML1\r\nU\r\n") == b""
    received = session.send(b"fC") + session.wait(0.5)
    assert {record[-2:] for record in split_records(received, (2, 4, 22, 23, 1))} == {b"\r\n"}


def test_gadgeteer() -> None:
    """`c f S`, lists with CR, `l1`; then `P` (11.3)."""
    session = DeviceSession()
    assert len(session.send(b"cfS")) == 55
    assert session.send(b"O1,2,11,1\rO2,2,11,1\r") == b""
    assert session.send(b"l1\r") == b"21l1111\r\n"
    session.send(b"l3,0\rl4,0\r")
    assert len(split_records(session.send(b"P", after_s=0.1), (2, 11, 1))) == 2


@pytest.mark.parametrize("size", range(1, 12))
def test_commands_may_be_split_anywhere(size: int) -> None:
    first_session, second_session = DeviceSession(), DeviceSession()
    messages = b"cO1,2,1\r\nO1\r\nfSl*\nP"
    reply = first_session.send(messages)
    parts = [messages[at : at + size] for at in range(0, len(messages), size)]
    assert b"".join(second_session.send(part) for part in parts) == reply
