"""Clients that are rude, slow, odd or one of many, at the emulator's pty (docs/is900.md 3 and 12)."""

import random
import re
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from tests.clients.device import device
from tests.clients.freevr import FreeVr
from tests.clients.gadgeteer import Late
from tests.clients.intersense import Library
from tests.clients.tty import Tty, raw, wait_until
from tests.clients.vrpn import Vrpn
from tests.clients.vrui import Vrui
from tests.clients.wire import cut

LIMIT_S = 60.0
STATUS = re.compile(rb"21S[0-9A-F]{3} {9}4\.2301 IS900VET {23}\r\n")
MIXED = (b"S", b"MG\r\n", b"MS\r\n", b"MP\r\n", b"O1\r\n", b"l*\r\n", b"Ms2\r\n", b"Mp3\r\n", b"MQ4\r\n", b"MCF1\r\n")
ANSWERS = (b"21S", b"31G", b"31S", b"31P", b"21O", b"21l", b"32s", b"33p", b"34Q", b"31F")


class Terminal:
    """Someone who types."""

    def __init__(self, port: str) -> None:
        self._tty = Tty(port, raw())

    def now(self) -> bytes:
        """What is there."""
        return self._tty.read(65536)

    def say(self, data: bytes) -> None:
        self._tty.write(data)

    def hear(self, pattern: bytes | re.Pattern[bytes]) -> bytes:
        """All since the last time, once this has come."""
        heard = b""

        def come() -> bool:
            nonlocal heard
            heard += self._tty.read(65536)
            return re.search(pattern, heard) is not None

        assert wait_until(come, LIMIT_S), heard[-200:]
        return heard

    def rest(self) -> bytes:
        """All that still comes before the answer to another question; the device must not be streaming."""
        self.say(b"Mg\r")
        heard = self.hear(rb"31g\d\r\n$")
        return heard[: heard.rindex(b"31g")]

    def close(self) -> None:
        self._tty.close()


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of a device that several tests use, one after another."""
    with device(tmp_path_factory.mktemp("shared"), rate_hz=40.0) as on:
        yield on.port


def answers(port: str) -> None:
    """A device in good health, whatever it went through, and quiet after `c`."""
    terminal = Terminal(port)
    terminal.say(b"\rc")
    terminal.rest()
    terminal.say(b"S")
    assert STATUS.fullmatch(terminal.rest())
    terminal.close()


def test_before_and_after_it_streams_and_twenty_times(tmp_path: Path) -> None:
    with device(tmp_path) as on:
        answers(on.port)
        terminal = Terminal(on.port)
        terminal.say(b"fO1,2,11,1\rO2,2,11,1\rO3,2,11,1\rO4,2,11,1\rC")
        terminal.hear(b"01 ")
        terminal.close()
        for _ in range(20):
            terminal = Terminal(on.port)
            heard = terminal.hear(re.compile(rb"\r\n01 (.{28})\r\n0", re.DOTALL))
            assert len(heard) > 33
            terminal.close()
        answers(on.port)
        for _ in range(20):
            answers(on.port)


def test_a_client_that_never_reads(tmp_path: Path) -> None:
    """Records go unread, whole, and the next client finds a device in good health."""
    with device(tmp_path, rate_hz=200.0, paced=False) as on:
        mute = Tty(on.port, raw())
        mute.write(b"fC")
        assert wait_until(lambda: mute.waiting > 3000, LIMIT_S)
        for _ in range(200):
            mute.write(b"SMP\r")
        time.sleep(1.0)
        mute.write(b"c")
        time.sleep(0.2)
        records, _ = cut(mute.read_available(100_000), {b"%d" % k: 29 for k in range(1, 5)})
        assert len(records) > 50
        mute.close()
        answers(on.port)
    assert on.summary["messages_unread"] > 100.0


def rubbish() -> Iterable[tuple[str, bytes]]:
    draw = random.Random(1)  # noqa: S311  # rubbish, nothing secret
    yield "no end of line", b"x" * 1_000_000
    yield "lines of nothing", b"\r\n" * 20_000
    yield "binary", bytes(draw.randrange(256) for _ in range(50_000))
    yield "high bytes", bytes(range(128, 256)) * 200
    names = b"O1, l1, A1, G1, H1, N1, V1, Mp1, MQ1, MF1, MH1, MG MU Mg MCF MCI1 MCf MEthIp1.2.3. MEthUdp MLB o o1152,N,"
    yield "digits that are none", b"".join(name + b"\xb2\r" + name + b"9" * 30 + b"\r" for name in names.split())
    words = (b"O", b"l", b"MCF", b"MG", b"A1", b"N2", b"MEthIp", b"o", b"1", b",", b"-", b"1e9", b"\xb2", b"*", b".")
    yield "nearly commands", b"".join(draw.choice(words) + draw.choice((b"", b"", b"\r")) for _ in range(5_000))


def test_rubbish(tmp_path: Path) -> None:
    """It may do to the settings what it happens to say, but the device goes on; a restart puts everything back."""
    with device(tmp_path, paced=False, restart_s=0.0) as on:
        for name, data in rubbish():
            tty = Tty(on.port, raw())
            for at in range(0, len(data), 1024):
                tty.write(data[at : at + 1024])
                tty.read(65536)
            tty.write(b"\r\x19")
            tty.close()
            assert Path(on.port).exists(), name
            answers(on.port)


def test_clients_one_after_another(tmp_path: Path) -> None:
    """Each with its own lists, units and formats; some leave it streaming, some with stations off."""
    with device(tmp_path, stations=2) as on:
        vrpn = Vrpn(on.port, is900_time=True, wands=(1,))
        assert vrpn.serve(lambda: len(vrpn.reports) >= 40, LIMIT_S), vrpn.said
        vrpn.close()
        library = Library(on.port, "2.09")
        assert library.open()
        assert library.run(lambda: library.stations[1].records >= 20, LIMIT_S)
        library.close()
        juggler = Late(on.port)
        juggler.open(LIMIT_S)
        juggler.sample(LIMIT_S)
        juggler.close()
        freevr = FreeVr(on.port, wands="2")
        assert freevr.open(LIMIT_S)
        assert freevr.run(lambda: freevr.units["2"].records >= 5, LIMIT_S), freevr.warnings
        freevr.close()
        vrui = Vrui(on.port, scale=0.05)
        assert vrui.open((2, 1))
        vrui.start()
        vrui.process(20, LIMIT_S)
        vrui.close()
        again = Vrpn(on.port)
        assert again.serve(lambda: len(again.reports) >= 40, LIMIT_S), again.said
        assert again.resyncs == []
        again.close()


SET_UP = b"c\x11fuO1,2,4,1\r\nO2,40,2,1\r\nMp1,20\r\nMT\r\nS"
ASKED = b"O1\r\nO2\r\nMp1\r\n"
ANSWERED = re.compile(rb"21S3F3 {9}4\.2301 IS900VET {23}\r\n21O 2 4 1\r\n22O40 2 1\r\n31p20\r\n")


@pytest.mark.parametrize("end", [b"\r", b"\n", b"\r\n", b"\n\r"])
@pytest.mark.parametrize("split", [1, 7, 1000])
def test_glued_and_split_commands_with_every_end_of_line(port: str, end: bytes, split: int) -> None:
    said = (SET_UP + ASKED).replace(b"\r\n", end)
    terminal = Terminal(port)
    terminal.say(b"\rcFUO1,2,4,1\rO2,2,4,1\rMp1,0\r")
    terminal.rest()
    for at in range(0, len(said), split):
        terminal.say(said[at : at + split])
        time.sleep(0.001)
    heard = terminal.rest()
    assert ANSWERED.fullmatch(heard), heard
    terminal.close()


@pytest.mark.parametrize("name", ["A", "a"])
def test_stations_in_either_case(tmp_path: Path, name: str) -> None:
    with device(tmp_path, stations=10) as on:
        terminal = Terminal(on.port)
        terminal.say(f"O{name},40,2,1\r\nO{name}\r\nl{name},0\r\nl*\r\nl{name}\r\nMs{name}\r\nMp{name}\r\n".encode())
        heard = terminal.hear(rb"3Ap.*\r\n")
        states = b"21l" + b"1" * 9 + b"0" * 23 + b"\r\n2Al0111\r\n"
        assert re.fullmatch(rb"2AO40 2 1\r\n" + states + rb"3As...\r\n3Ap..\r\n", heard), heard
        terminal.close()


def test_unknown_commands_get_an_error_record_and_change_nothing(port: str) -> None:
    terminal = Terminal(port)
    terminal.say(b"\rc")
    terminal.rest()
    for wrong in (b"O1,2,99,1", b"O", b"Oz,2,4,1", b"Mp1,51", b"e1,0", b"T", b"hello", b"A1,0,0,0", b"x" * 300):
        terminal.say(b"O1,2,4,1\r" + wrong + b"\rO1\r")
        heard = terminal.hear(rb"21O[ \d]*\r\n")
        _, replies = cut(heard, {})
        assert [reply[:3] for reply in replies] == [b"2 E", b"21O"], heard
        assert replies[1] == b"21O 2 4 1\r\n"
    for ignored in (b"x0.2,0.2,0.8,0.8", b"v0.2,0.2,0.8,0.8"):
        terminal.say(ignored + b"\rO1\r")
        assert terminal.hear(rb"21O[ \d]*\r\n") == b"21O 2 4 1\r\n"
    terminal.close()


def asked_while_data_flow(port: str, binary: bool, seconds: float) -> None:
    """All questions, glued, split and at odd moments; nothing but whole records and whole answers comes."""
    draw = random.Random(2)  # noqa: S311  # odd moments, nothing secret
    lists = (b"2,4,1", b"40,2,11,21,1", b"2,11,0", b"2,4,22,23,1")
    sizes = (29, 38, 32, 32) if binary else (47, 72, 53, 60)
    terminal = Terminal(port)
    terminal.say(b"\rcFU")
    terminal.rest()
    for station, items in enumerate(lists, start=1):
        terminal.say(b"O%d,%s\r" % (station, items))
    terminal.say(b"fC" if binary else b"FC")
    heard, asked = b"", 0
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        question = draw.choice(MIXED)
        for byte in question if draw.random() < 0.2 else [question]:
            terminal.say(byte if isinstance(byte, bytes) else bytes([byte]))
            time.sleep(draw.choice((0.0, 0.001, 0.01, 0.03)))
        asked += 1
        heard += terminal.now()
    terminal.say(b"c")
    heard += terminal.rest()
    records, replies = cut(heard, {b"%d" % k: size for k, size in enumerate(sizes, start=1)})
    assert len(replies) == asked
    assert {reply[:3] for reply in replies} == set(ANSWERS)
    shares = [sum(record[1:2] == b"%d" % k for record in records) for k in range(1, 5)]
    assert min(shares) > 10.0 * seconds
    assert max(shares) - min(shares) < 0.2 * max(shares)
    assert all(record.endswith(b"\r\n") for record in records if record[1:2] != b"3")
    terminal.close()


@pytest.mark.parametrize("binary", [True, False])
def test_questions_never_split_a_record(port: str, binary: bool) -> None:
    asked_while_data_flow(port, binary, 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("binary", [True, False])
def test_questions_never_split_a_record_for_a_minute(port: str, binary: bool) -> None:
    asked_while_data_flow(port, binary, 60.0)


def test_p_while_polled(port: str) -> None:
    """One record of each active station, in ascending order, each time."""
    terminal = Terminal(port)
    terminal.say(b"\rcFUO1,2,4,1\rO2,2,4,1\rO3,2,4,1\rO4,2,4,1\rl3,0\r")
    terminal.rest()
    terminal.say(b"PPP")
    heard = terminal.hear(re.compile(rb"(04 .{42}\r\n.*){3}", re.DOTALL)) + terminal.rest()
    records, replies = cut(heard, {b"1": 47, b"2": 47, b"4": 47})
    assert [record[1:2] for record in records] == [b"1", b"2", b"4"] * 3
    assert not replies
    terminal.say(b"l3,1\r")
    terminal.rest()
    terminal.close()
