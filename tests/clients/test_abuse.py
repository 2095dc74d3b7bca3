"""Clients that are rude, slow, unusual or one of many, at the emulator's pty (docs/is900.md 3 and 12)."""

import random
import re
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from tests.clients.device import run_device
from tests.clients.freevr import FreeVrClient
from tests.clients.gadgeteer import VrJuggler
from tests.clients.intersense import InterSenseClient
from tests.clients.tty import Tty, raw_mode, wait_until
from tests.clients.vrpn import VrpnClient
from tests.clients.vrui import VruiClient
from tests.clients.wire import split_records_and_replies

LIMIT_S = 60.0
STATUS = re.compile(rb"21S[0-9A-F]{3} {9}4\.2301 IS900VET {23}\r\n")
MIXED = (
    b"S",
    b"MG\r\n",
    b"MS\r\n",
    b"MP\r\n",
    b"O1\r\n",
    b"l*\r\n",
    b"Ms2\r\n",
    b"Mp3\r\n",
    b"MQ4\r\n",
    b"MCF1\r\n",
)
QUERY_REPLY_HEADS = (b"21S", b"31G", b"31S", b"31P", b"21O", b"21l", b"32s", b"33p", b"34Q", b"31F")


class Terminal:
    """A user who types commands."""

    def __init__(self, port: str) -> None:
        self._tty = Tty(port, raw_mode())

    def read_available(self) -> bytes:
        """Return the available bytes."""
        return self._tty.read(65536)

    def send(self, data: bytes) -> None:
        self._tty.write(data)

    def read_until(self, pattern: bytes | re.Pattern[bytes]) -> bytes:
        """Return all bytes since the last call, once they contain this pattern."""
        received = b""

        def has_pattern() -> bool:
            nonlocal received
            received += self._tty.read(65536)
            return re.search(pattern, received) is not None

        assert wait_until(has_pattern, LIMIT_S), received[-200:]
        return received

    def read_rest(self) -> bytes:
        """Return all bytes before the reply to another query; the device must not be streaming."""
        self.send(b"Mg\r")
        received = self.read_until(rb"31g\d\r\n$")
        return received[: received.rindex(b"31g")]

    def close(self) -> None:
        self._tty.close()


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Port of a device that several tests use, one after another."""
    with run_device(tmp_path_factory.mktemp("shared"), rate_hz=40.0) as device:
        yield device.port


def check_health(port: str) -> None:
    """Check that the device answers correctly in any state, and is silent after `c`."""
    terminal = Terminal(port)
    terminal.send(b"\rc")
    terminal.read_rest()
    terminal.send(b"S")
    assert STATUS.fullmatch(terminal.read_rest())
    terminal.close()


def test_a_device_answers_before_and_after_streaming(tmp_path: Path) -> None:
    with run_device(tmp_path) as device:
        check_health(device.port)
        terminal = Terminal(device.port)
        terminal.send(b"fO1,2,11,1\rO2,2,11,1\rO3,2,11,1\rO4,2,11,1\rC")
        terminal.read_until(b"01 ")
        terminal.close()
        for _ in range(20):
            terminal = Terminal(device.port)
            received = terminal.read_until(re.compile(rb"\r\n01 (.{28})\r\n0", re.DOTALL))
            assert len(received) > 33
            terminal.close()
        check_health(device.port)
        for _ in range(20):
            check_health(device.port)


def test_a_client_that_never_reads(tmp_path: Path) -> None:
    """Whole records are dropped, and the next client finds a working device."""
    with run_device(tmp_path, rate_hz=200.0, paced=False) as device:
        silent_client = Tty(device.port, raw_mode())
        silent_client.write(b"fC")
        assert wait_until(lambda: silent_client.waiting > 3000, LIMIT_S)
        for _ in range(200):
            silent_client.write(b"SMP\r")
        time.sleep(1.0)
        silent_client.write(b"c")
        time.sleep(0.2)
        records, _ = split_records_and_replies(
            silent_client.read_available(100_000), {b"%d" % k: 29 for k in range(1, 5)}
        )
        assert len(records) > 50
        silent_client.close()
        check_health(device.port)
    assert device.summary["messages_unread"] > 100.0


def garbage_inputs() -> Iterable[tuple[str, bytes]]:
    draw = random.Random(1)  # noqa: S311  # garbage, nothing secret
    yield "no end of line", b"x" * 1_000_000
    yield "lines of nothing", b"\r\n" * 20_000
    yield "binary", bytes(draw.randrange(256) for _ in range(50_000))
    yield "high bytes", bytes(range(128, 256)) * 200
    names = b"O1, l1, A1, G1, H1, N1, V1, Mp1, MQ1, MF1, MH1, MG MU Mg MCF MCI1 MCf MEthIp1.2.3. MEthUdp MLB o o1152,N,"
    yield "digits that are none", b"".join(name + b"\xb2\r" + name + b"9" * 30 + b"\r" for name in names.split())
    words = (b"O", b"l", b"MCF", b"MG", b"A1", b"N2", b"MEthIp", b"o", b"1", b",", b"-", b"1e9", b"\xb2", b"*", b".")
    yield (
        "nearly commands",
        b"".join(draw.choice(words) + draw.choice((b"", b"", b"\r")) for _ in range(5_000)),
    )


def test_garbage_leaves_the_device_working(tmp_path: Path) -> None:
    """Garbage may change settings by chance, but the device keeps working; a restart restores its settings."""
    with run_device(tmp_path, paced=False, restart_s=0.0) as device:
        for name, data in garbage_inputs():
            tty = Tty(device.port, raw_mode())
            for at in range(0, len(data), 1024):
                tty.write(data[at : at + 1024])
                tty.read(65536)
            tty.write(b"\r\x19")
            while tty.wait(0.3):  # a full port would drop the replies to `check_health`
                tty.read(65536)
            tty.close()
            assert Path(device.port).exists(), name
            check_health(device.port)


def test_clients_one_after_another(tmp_path: Path) -> None:
    """Each has its own lists, units and formats; some leave the device streaming, some leave stations off."""
    with run_device(tmp_path, stations=2) as device:
        vrpn = VrpnClient(device.port, is900_time=True, wands=(1,))
        assert vrpn.serve(lambda: len(vrpn.reports) >= 40, LIMIT_S), vrpn.log
        vrpn.close()
        intersense = InterSenseClient(device.port, "2.09")
        assert intersense.open()
        assert intersense.run(lambda: intersense.stations[1].records >= 20, LIMIT_S)
        intersense.close()
        juggler = VrJuggler(device.port)
        juggler.open(LIMIT_S)
        juggler.sample(LIMIT_S)
        juggler.close()
        freevr = FreeVrClient(device.port, wands="2")
        assert freevr.open(LIMIT_S)
        assert freevr.run(lambda: freevr.stations["2"].records >= 5, LIMIT_S), freevr.warnings
        freevr.close()
        vrui = VruiClient(device.port, scale=0.05)
        assert vrui.open((2, 1))
        vrui.start()
        vrui.process(20, LIMIT_S)
        vrui.close()
        last_client = VrpnClient(device.port)
        assert last_client.serve(lambda: len(last_client.reports) >= 40, LIMIT_S), last_client.log
        assert last_client.resyncs == []
        last_client.close()


SETTERS = b"c\x11fuO1,2,4,1\r\nO2,40,2,1\r\nMp1,20\r\nMT\r\nS"
QUERIES = b"O1\r\nO2\r\nMp1\r\n"
EXPECTED_REPLIES = re.compile(rb"21S3F3 {9}4\.2301 IS900VET {23}\r\n21O 2 4 1\r\n22O40 2 1\r\n31p20\r\n")


@pytest.mark.parametrize("end", [b"\r", b"\n", b"\r\n", b"\n\r"])
@pytest.mark.parametrize("split", [1, 7, 1000])
def test_joined_and_split_commands_with_every_line_end(port: str, end: bytes, split: int) -> None:
    log = (SETTERS + QUERIES).replace(b"\r\n", end)
    terminal = Terminal(port)
    terminal.send(b"\rcFUO1,2,4,1\rO2,2,4,1\rMp1,0\r")
    terminal.read_rest()
    for at in range(0, len(log), split):
        terminal.send(log[at : at + split])
        time.sleep(0.001)
    received = terminal.read_rest()
    assert EXPECTED_REPLIES.fullmatch(received), received
    terminal.close()


def query_while_streaming(port: str, binary: bool, seconds: float) -> None:
    """Send all queries, joined, split and at random times; only whole records and whole replies arrive."""
    draw = random.Random(2)  # noqa: S311  # random times, nothing secret
    lists = (b"2,4,1", b"40,2,11,21,1", b"2,11,0", b"2,4,22,23,1")
    sizes = (29, 38, 32, 32) if binary else (47, 72, 53, 60)
    terminal = Terminal(port)
    terminal.send(b"\rcFU")
    terminal.read_rest()
    for station, items in enumerate(lists, start=1):
        terminal.send(b"O%d,%s\r" % (station, items))
    terminal.send(b"fC" if binary else b"FC")
    received, query_count = b"", 0
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        query = draw.choice(MIXED)
        for byte in query if draw.random() < 0.2 else [query]:
            terminal.send(byte if isinstance(byte, bytes) else bytes([byte]))
            time.sleep(draw.choice((0.0, 0.001, 0.01, 0.03)))
        query_count += 1
        received += terminal.read_available()
    terminal.send(b"c")
    received += terminal.read_rest()
    records, replies = split_records_and_replies(received, {b"%d" % k: size for k, size in enumerate(sizes, start=1)})
    assert len(replies) == query_count
    assert {reply[:3] for reply in replies} == set(QUERY_REPLY_HEADS)
    station_counts = [sum(record[1:2] == b"%d" % k for record in records) for k in range(1, 5)]
    assert min(station_counts) > 10.0 * seconds
    assert max(station_counts) - min(station_counts) < 0.2 * max(station_counts)
    assert all(record.endswith(b"\r\n") for record in records if record[1:2] != b"3")
    terminal.close()


@pytest.mark.long
@pytest.mark.parametrize("binary", [True, False])
def test_queries_never_split_a_record(port: str, binary: bool) -> None:
    query_while_streaming(port, binary, 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("binary", [True, False])
def test_queries_never_split_a_record_for_a_minute(port: str, binary: bool) -> None:
    query_while_streaming(port, binary, 60.0)
