"""The start-up dialogues of docs/is900.md 11, byte for byte, against the device alone.

Times between the bytes are those that the clients were seen to leave; re-enacted clients on real ports are in
tests/clients.
"""

import pytest

from harness.stream.codec.items import record_size
from harness.stream.emulator.config import EmulatorConfig
from tests.stream.emulator.played import Talk


def records(data: bytes, items: tuple[int, ...]) -> list[bytes]:
    """Binary records, each of the size of this list."""
    length = record_size(items)
    assert data
    assert len(data) % length == 0
    found = [data[at : at + length] for at in range(0, len(data), length)]
    assert all(record[:1] == b"0" and record[2:3] == b" " for record in found)
    return found


def test_vrpn() -> None:
    """Four stations, `O...,2,11,0`, inches by default; `x` and `v` are taken in silence (11.1)."""
    talk = Talk()
    assert talk.say(b"c") == b""
    status = talk.say(b"S", after_s=4.0)
    assert (len(status), status[:1], status[-1:]) == (55, b"2", b"\n")
    for station in b"1234":
        assert talk.say(b"O%c,2,11,0\r" % station, after_s=0.05) == b""
    assert talk.say(b"x0.2,0.2,0.8,0.8\r", after_s=1.0) == b""
    assert talk.say(b"v0.2,0.2,0.8,0.8\r", after_s=1.0) == b""
    talk.say(b"fC", after_s=1.0)
    found = records(talk.wait(1.0), (2, 11, 0))
    assert len(found) == pytest.approx(4 * 50, abs=8)
    assert {record[1:2] for record in found} == {b"1", b"2", b"3", b"4"}
    assert {record[-1:] for record in found} == {b" "}


def test_vrpn_with_is900time_and_a_wand() -> None:
    """`MT` and `MZ` come right after `fC`, in one read; lists are sent once before the reset too (11.1)."""
    wand, plain = b"O1,2,11,21,22,23,0\r", b"O2,2,11,21,0\rl3,0\rl4,0\r"
    talk = Talk()
    talk.say(b"fC")
    talk.wait(0.5)  # left streaming by whoever was here before
    talk.say(wand + plain)
    talk.say(b"c")
    assert talk.wait(2.0) == b""
    assert len(talk.say(b"S", after_s=2.0)) == 55
    assert talk.say(wand + plain + b"x0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\r", after_s=1.0) == b""
    heard = talk.say(b"fCMT\rMZ\r", after_s=2.0) + talk.wait(0.5)
    assert heard[:3] == b"01 "
    first, second = record_size((2, 11, 21, 22, 23, 0)), record_size((2, 11, 21, 0))
    assert len(heard) % (first + second) in (0, first)
    assert heard[first : first + 3] == b"02 "


def test_vrpn_resets_a_device_that_does_not_answer() -> None:
    """CR, 19 and `c`, each byte 2 s after the last, and 20 s more; the last resorts have letters without CR (11.1)."""
    for characters in (b"\r\x19c", b"\rt\x19c", b"\rYt\x19c"):
        talk = Talk(EmulatorConfig(restart_s=10.0))
        for byte in characters:
            assert talk.say(bytes([byte]), after_s=2.0) == b""
        assert len(talk.say(b"S", after_s=20.0)) == 55


def test_intersenses_library() -> None:
    """The first `MS` is glued to letters for another product; lists must be answered as they were set (11.2)."""
    talk = Talk()
    for _ in range(3):
        talk.say(b"c*reset", after_s=0.15)
    assert not talk.say(b"MS\r\n").startswith(b"31S")
    assert talk.say(b"c") == b""
    assert talk.say(b"MS\r\n", after_s=0.15) == b"31Sg08\r\n"
    assert talk.say(b"S")[15:32] == b"4.2301 IS900VET  "
    assert talk.say(b"c") == b""
    for station in b"12345678":
        assert talk.say(b"O%c,2,4,1\r\n" % station) == b""
        assert talk.say(b"O%c\r\n" % station) == b"2%cO 2 4 1\r\n" % station
    assert talk.say(b"O1,2,4,21,22,23,40,1\r\nO1\r\n") == b"21O 2 421222340 1\r\n"
    assert talk.say(b"O1,2,4,1\r\nl*\r\n") == b"21l1111" + b"0" * 28 + b"\r\n"
    talk.say(b"fu")
    talk.say(b"C\x11")
    talk.device.receive(b"SMG\r\n", talk.now_s + 0.5)
    said = [message for message in talk.device.messages(talk.now_s + 1.0) if not message.station]
    assert [message.data[:3] for message in said] == [b"21S", b"31G"]
    assert said[0].data[3:6] == b"3FB"
    talk.now_s += 1.0
    talk.say(b"c")
    assert talk.wait(1.0) == b""


def test_freevr() -> None:
    """Lines end in LF or LF CR; data by `P`, in ASCII (11.3)."""
    talk = Talk()
    said = talk.say(b"cFUSl*\nMCF\nMP\n").split(b"\r\n")
    assert [line[:3] for line in said[:2]] == [b"21S", b"21l"]
    assert {(line[:3], len(line)) for line in said[2:-2]} == {(b"31F", 68)}
    assert (said[-2][:3], len(said[-2])) == (b"31P", 46)
    for station in b"123456789ABC":
        assert talk.say(b"O%c,40,2,4,1\n\r" % station) == b""
        assert talk.say(b"O%c\r" % station) == b"2%cO40 2 4 1\r\n" % station
    for _ in range(3):
        lines = talk.say(b"P", after_s=0.1).split(b"\r\n")
        assert [(line[:3], len(line)) for line in lines] == [(b"0%c " % s, 49) for s in b"1234"] + [(b"", 0)]
        assert lines[0][3:7] == b" 255"
        assert len(talk.say(b"MP\n")) == 48


def test_vrui() -> None:
    """Resets with 19, sets every station up, then binary with CR LF (11.3)."""
    talk = Talk()
    assert talk.say(b"\x19") == b""
    assert len(talk.say(b"cS\r\nl*\r\n", after_s=15.0)) == 55 + 37
    for station in b"12":
        for line in (b"l%c,1", b"R%c", b"b%c", b"N%c,0.0,0.0,0.0", b"Mp%c,0", b"MF%c,2", b"MQ%c,3"):
            assert talk.say(line % station + b"\r\n") == b""
        assert talk.say(b"O%c,2,4,22,23,1\r\n" % station) == b""
    assert talk.say(b"l3,0\r\nl4,0\r\nML1\r\nU\r\n") == b""
    heard = talk.say(b"fC") + talk.wait(0.5)
    assert {record[-2:] for record in records(heard, (2, 4, 22, 23, 1))} == {b"\r\n"}


def test_gadgeteer() -> None:
    """`c f S`, lists with CR, `l1`; then `P` (11.3)."""
    talk = Talk()
    assert len(talk.say(b"cfS")) == 55
    assert talk.say(b"O1,2,11,1\rO2,2,11,1\r") == b""
    assert talk.say(b"l1\r") == b"21l1111\r\n"
    talk.say(b"l3,0\rl4,0\r")
    assert len(records(talk.say(b"P", after_s=0.1), (2, 11, 1))) == 2


@pytest.mark.parametrize("cut", range(1, 12))
def test_commands_may_come_in_any_pieces(cut: int) -> None:
    whole, pieces = Talk(), Talk()
    said = b"cO1,2,1\r\nO1\r\nfSl*\nP"
    answer = whole.say(said)
    parts = [said[at : at + cut] for at in range(0, len(said), cut)]
    assert b"".join(pieces.say(part) for part in parts) == answer
