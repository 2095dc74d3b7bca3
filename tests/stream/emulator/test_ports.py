"""Real ports: clients that come and go, that do not read, that find something else; links that are made and removed."""

import itertools
import os
import select
import socket
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from harness.errors import BadInput
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.faults import Fault
from harness.stream.emulator.message import SentMessage
from harness.stream.emulator.pty_port import PtyPort
from harness.stream.emulator.server import RunningEmulator, open_port, serve_emulator
from harness.stream.emulator.tcp_port import TcpPort
from tests.stream.emulator.played import samples

PATIENT_S = 120.0
SET_UP = b"cO1,40,2,11,21,1\rO2,40,2,11,21,1\rO3,40,2,11,21,1\rO4,40,2,11,21,1\rfuMZ\rC"


@pytest.fixture
def link(tmp_path: Path) -> Path:
    return tmp_path / "is900"


@pytest.fixture
def on_pty(link: Path) -> Iterator[RunningEmulator]:
    with serve_emulator(samples(), pty=link) as emulator:
        yield emulator


def wait_until(condition: Callable[[], object]) -> None:
    until_s = time.monotonic() + PATIENT_S
    while not condition():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def hear(descriptor: int, count: int, patient_s: float = PATIENT_S) -> bytes:
    """So many bytes; fewer when no more come, or the other end is gone."""
    data = b""
    while len(data) < count and select.select([descriptor], [], [], patient_s)[0]:
        try:
            came = os.read(descriptor, count - len(data))
        except OSError:
            break  # the pty's other end is closed
        if not came:
            break
        data += came
    return data


def opened(link: Path) -> int:
    return os.open(link, os.O_RDWR | os.O_NOCTTY)


def test_a_client_may_close_the_pty_and_open_it_again(on_pty: RunningEmulator, link: Path) -> None:
    for _ in range(3):
        client = opened(link)
        os.write(client, b"S")
        assert hear(client, 55)[:6] == b"21S3F0"
        os.close(client)


def test_a_pty_is_raw_and_echoes_nothing(on_pty: RunningEmulator, link: Path) -> None:
    client = opened(link)
    _, output, _, local = termios.tcgetattr(client)[:4]
    assert not local & (termios.ECHO | termios.ICANON | termios.ISIG)
    assert not output & termios.OPOST
    os.write(client, b"\r\nO1\r\n\x13\x11S")
    assert hear(client, 11 + 55) == b"21O 2 4 1\r\n21S3F0" + b" " * 9 + b"4.2301 IS900VET" + b" " * 23 + b"\r\n"
    os.close(client)


def test_a_client_that_does_not_read_costs_whole_records(on_pty: RunningEmulator, link: Path) -> None:
    client = opened(link)
    os.write(client, SET_UP)
    wait_until(lambda: on_pty.server.counts.unread > 50)
    os.write(client, b"c")
    wait_until(lambda: not on_pty.emulator.device.streaming)
    # The record on the line when the order came still ends, and finds room if we read by then: hence until silence.
    data = hear(client, 2 * 4096, patient_s=3.0)
    assert len(data) == on_pty.server.counts.bytes <= 4096 + 38
    assert len(data) % 38 == 0
    assert {data[at : at + 1] for at in range(0, len(data), 38)} == {b"0"}
    os.write(client, b"S")
    assert hear(client, 55)[:6] == b"21S3F3"
    os.close(client)


def test_unplugged_the_pty_goes_dead_and_comes_back(link: Path) -> None:
    config = EmulatorConfig(faults=(Fault("disconnect", at_s=(0.3,), lasts_s=0.3),))
    with serve_emulator(samples(), config, pty=link) as served:
        client = opened(link)
        wait_until(lambda: not link.is_symlink())
        began_s = time.monotonic()
        assert hear(client, 1) == b""
        assert time.monotonic() - began_s < PATIENT_S / 2
        os.close(client)
        wait_until(link.exists)
        client = opened(link)
        os.write(client, b"S")
        assert hear(client, 55)[:3] == b"21S"
        os.close(client)
        assert [spell.fault.kind for spell in served.emulator.episodes] == ["disconnect"]
    assert not os.path.lexists(link)


def test_nothing_that_is_there_is_overwritten(link: Path, on_pty: RunningEmulator, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="leads to /dev/pts/"):
        PtyPort(link)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(BadInput, match="no link of an emulator"):
        PtyPort(tmp_path / "file")
    (tmp_path / "other").symlink_to(tmp_path / "nowhere")
    with pytest.raises(BadInput, match="leads to"):
        PtyPort(tmp_path / "other")
    with pytest.raises(BadInput, match="No such file"):
        PtyPort(tmp_path / "no" / "folder")
    assert (tmp_path / "file").read_text() == "mine"
    assert (tmp_path / "other").is_symlink()


def test_a_link_of_a_killed_emulator_is_replaced(link: Path) -> None:
    link.symlink_to("/dev/pts/99999")
    with serve_emulator(samples(), pty=link) as emulator:
        assert os.path.exists(emulator.name)
    assert not os.path.lexists(link)


@pytest.mark.parametrize(("rate", "answered"), [(termios.B9600, False), (termios.B115200, True)])
def test_the_wrong_rate_is_noise_when_that_is_looked_at(link: Path, rate: int, answered: bool) -> None:
    with serve_emulator(samples(), EmulatorConfig(check_baud=True), pty=link):
        client = opened(link)
        modes = termios.tcgetattr(client)
        modes[4] = modes[5] = rate
        termios.tcsetattr(client, termios.TCSANOW, modes)
        os.write(client, b"S")
        assert (hear(client, 55, patient_s=PATIENT_S if answered else 0.3)[:3] == b"21S") is answered
        os.close(client)


def test_tcp_serves_one_client_after_another(tmp_path: Path) -> None:
    with serve_emulator(samples(), tcp="127.0.0.1:0") as emulator:
        address = ("127.0.0.1", int(emulator.name.rpartition(":")[2]))
        for _ in range(3):
            with socket.create_connection(address, PATIENT_S) as client:
                client.sendall(b"S")
                assert hear(client.fileno(), 55)[:6] == b"21S3F0"
        with pytest.raises(BadInput, match="Choose another port"):
            open_port(None, f"127.0.0.1:{address[1]}")


def test_a_second_client_is_turned_away_and_told_of(tmp_path: Path) -> None:
    said: list[str] = []
    port = TcpPort("127.0.0.1", 0, log=said.append)
    address = ("127.0.0.1", int(port.name.rpartition(":")[2]))
    with socket.create_connection(address, PATIENT_S), socket.create_connection(address, PATIENT_S) as second:
        wait_until(lambda: (port.read() == b"") and len(said) > 1)
        assert second.recv(1) == b""
    assert "turned away" in said[1]
    wait_until(lambda: (port.read() == b"") and said[-1] == "client gone")
    port.close()


def test_a_tcp_client_that_does_not_read_neither_blocks_nor_grows() -> None:
    with serve_emulator(
        samples(rate_hz=900.0, instants=900), EmulatorConfig(paced=False), tcp="127.0.0.1:0"
    ) as emulator:
        client = socket.socket()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.connect(("127.0.0.1", int(emulator.name.rpartition(":")[2])))
        client.sendall(SET_UP)
        wait_until(lambda: emulator.server.counts.unread > 100)
        client.sendall(b"c")
        wait_until(lambda: not emulator.emulator.device.streaming)
        client.settimeout(PATIENT_S)
        wanted = emulator.server.counts.bytes
        data = hear(client.fileno(), wanted)
        assert {data[at : at + 1] for at in range(0, len(data), 38)} == {b"0"}
        client.close()


def test_only_this_computer_reaches_it_unless_asked() -> None:
    with pytest.raises(BadInput, match="--anywhere"):
        open_port(None, "0.0.0.0:0")
    port = open_port(None, "0.0.0.0:0", anywhere=True)
    assert port.name.startswith("tcp://0.0.0.0:")
    port.close()


@pytest.mark.parametrize("text", ["5005", "localhost", "127.0.0.1:", "127.0.0.1:99999", "127.0.0.1:x"])
def test_a_port_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="HOST:PORT"):
        open_port(None, text)


def test_one_place_is_asked_for(link: Path) -> None:
    for places in ((None, None), (link, "127.0.0.1:0")):
        with pytest.raises(BadInput, match="Name one"):
            open_port(*places)


def test_records_are_due_at_the_lines_pace_and_written_no_earlier(link: Path) -> None:
    sent: list[SentMessage] = []
    with serve_emulator(samples(), pty=link, on_sent=sent.append) as emulator:
        client = opened(link)
        os.write(client, SET_UP)
        hear(client, 38 * 200)
        os.close(client)
    summary = emulator.summary()
    records = [one for one in sent if one.message.station and not one.unread]
    due = [one.due_s for one in records]
    assert all(one.written_s >= one.due_s for one in records)
    assert all(b - a > 38 * 10 / 115200 - 1e-9 for a, b in itertools.pairwise(due))
    assert due[199] - due[0] == pytest.approx(199 / 200, abs=0.01)
    assert summary["records_sent"] == len(records)
    assert summary["pacing_max_ms"] >= summary["pacing_p99_ms"] >= summary["pacing_p50_ms"] >= 0.0


def test_waiting_costs_no_time_of_the_processor(link: Path) -> None:
    """Alone in a process: 2 s of silence."""
    code = f"""
import time
from harness.stream.emulator.server import serving
from tests.stream.emulator.played import samples
with serving(samples(), pty={str(link)!r}):
    before = time.process_time()
    time.sleep(2.0)
    print(time.process_time() - before)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert float(done.stdout) < 0.2
