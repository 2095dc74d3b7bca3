"""Real ports: clients that come and go or do not read, places that are occupied, links that are made and removed."""

import itertools
import os
import re
import select
import socket
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from harness.errors import BadInput
from harness.stream.client_socket import MAX_CLIENTS
from harness.stream.emulators import serve_emulator
from harness.stream.is900.emulator.emulator import Emulator
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device_state import SentMessage
from harness.stream.polhemus.emulator.faults import Fault
from harness.stream.polhemus.emulator.pty_port import PtyPort
from harness.stream.polhemus.emulator.server import EmulatorServer, open_port
from harness.stream.polhemus.emulator.tcp_port import TcpPort
from tests.stream.is900.emulator.played import make_samples

TIMEOUT_S = 120.0
SET_UP = b"cO1,40,2,11,21,1\rO2,40,2,11,21,1\rO3,40,2,11,21,1\rO4,40,2,11,21,1\rfuMZ\rC"


@pytest.fixture
def link(tmp_path: Path) -> Path:
    return tmp_path / "is900"


@pytest.fixture
def pty_emulator(link: Path) -> Iterator[EmulatorServer]:
    with serve_emulator(make_samples(), pty=link) as emulator:
        yield emulator


def wait_until(condition: Callable[[], object]) -> None:
    until_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def read_bytes(descriptor: int, count: int, timeout_s: float = TIMEOUT_S) -> bytes:
    """Read this many bytes; fewer when no more arrive or the other end is gone."""
    data = b""
    while len(data) < count and select.select([descriptor], [], [], timeout_s)[0]:
        try:
            chunk = os.read(descriptor, count - len(data))
        except OSError:
            break  # the pty's other end is closed
        if not chunk:
            break
        data += chunk
    return data


def open_client(link: Path) -> int:
    return os.open(link, os.O_RDWR | os.O_NOCTTY)


def test_a_client_may_close_and_reopen_the_pty(pty_emulator: EmulatorServer, link: Path) -> None:
    for _ in range(3):
        client = open_client(link)
        os.write(client, b"S")
        assert read_bytes(client, 55)[:6] == b"21S3F0"
        os.close(client)


def test_a_pty_is_raw_and_echoes_nothing(pty_emulator: EmulatorServer, link: Path) -> None:
    client = open_client(link)
    _, output, _, local = termios.tcgetattr(client)[:4]
    assert not local & (termios.ECHO | termios.ICANON | termios.ISIG)
    assert not output & termios.OPOST
    os.write(client, b"\r\nO1\r\n\x13\x11S")
    assert read_bytes(client, 11 + 55) == b"21O 2 4 1\r\n21S3F0" + b" " * 9 + b"4.2301 IS900VET" + b" " * 23 + b"\r\n"
    os.close(client)


@pytest.mark.long
def test_a_client_that_does_not_read_loses_whole_records(pty_emulator: EmulatorServer, link: Path) -> None:
    client = open_client(link)
    os.write(client, SET_UP)
    wait_until(lambda: pty_emulator.counts.unread > 50)
    os.write(client, b"c")
    wait_until(lambda: not pty_emulator.emulator.device.streaming)
    # The record on the line when `c` arrived is still sent, and fits if the client reads by then: read until silence.
    data = read_bytes(client, 2 * 4096, timeout_s=3.0)
    assert len(data) == pty_emulator.counts.bytes <= 4096 + 38
    assert len(data) % 38 == 0
    assert {data[at : at + 1] for at in range(0, len(data), 38)} == {b"0"}
    os.write(client, b"S")
    assert read_bytes(client, 55)[:6] == b"21S3F3"
    os.close(client)


def test_an_unplugged_pty_disappears_and_returns(link: Path) -> None:
    config = EmulatorConfig(faults=(Fault("disconnect", at_s=(0.3,), lasts_s=0.3),))
    with serve_emulator(make_samples(), config, pty=link) as emulator:
        client = open_client(link)
        wait_until(lambda: not link.is_symlink())
        began_s = time.monotonic()
        assert read_bytes(client, 1) == b""
        assert time.monotonic() - began_s < TIMEOUT_S / 2
        os.close(client)
        wait_until(link.exists)
        client = open_client(link)
        os.write(client, b"S")
        assert read_bytes(client, 55)[:3] == b"21S"
        os.close(client)
        assert [episode.fault.kind for episode in emulator.emulator.episodes] == ["disconnect"]
    assert not os.path.lexists(link)


def test_no_existing_file_is_overwritten(link: Path, pty_emulator: EmulatorServer, tmp_path: Path) -> None:
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
    with serve_emulator(make_samples(), pty=link) as emulator:
        assert os.path.exists(emulator.name)
    assert not os.path.lexists(link)


@pytest.mark.parametrize(("rate", "answered"), [(termios.B9600, False), (termios.B115200, True)])
def test_a_wrong_baud_rate_gives_noise(link: Path, rate: int, answered: bool) -> None:
    with serve_emulator(make_samples(), EmulatorConfig(check_baud=True), pty=link):
        client = open_client(link)
        modes = termios.tcgetattr(client)
        modes[4] = modes[5] = rate
        termios.tcsetattr(client, termios.TCSANOW, modes)
        os.write(client, b"S")
        assert (read_bytes(client, 55, timeout_s=TIMEOUT_S if answered else 0.3)[:3] == b"21S") is answered
        os.close(client)


def connect(emulator: EmulatorServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", int(emulator.name.rpartition(":")[2])), TIMEOUT_S)


def test_idle_tcp_clients_block_nobody() -> None:
    """One is silent, and one stops in the middle of a command; others get their answers."""
    with serve_emulator(make_samples(), tcp="127.0.0.1:0") as emulator, connect(emulator), connect(emulator) as partial:
        partial.sendall(b"O1,2,4")
        for _ in range(2):
            with connect(emulator) as client:
                client.sendall(b"S")
                assert read_bytes(client.fileno(), 55)[:6] == b"21S3F0"
        partial.sendall(b",21,1\rO1\r")
        assert read_bytes(partial.fileno(), 13) == b"21O 2 421 1\r\n"
        with pytest.raises(BadInput, match="Choose another port"):
            open_port(None, emulator.name.removeprefix("tcp://"))


def test_a_client_that_has_the_device_keeps_it_until_it_is_idle() -> None:
    messages: list[str] = []
    port = TcpPort("127.0.0.1", 0, log=messages.append, idle_s=0.5)
    address = ("127.0.0.1", int(port.name.rpartition(":")[2]))
    with (
        socket.create_connection(address, TIMEOUT_S) as first,
        socket.create_connection(address, TIMEOUT_S) as second,
        socket.create_connection(address, TIMEOUT_S) as third,
    ):
        wait_until(lambda: port.read() == b"" and len(messages) == 3)
        assert not port.write(b"nobody has sent a command")
        first.sendall(b"S")
        wait_until(lambda: port.read() == b"S")
        second.sendall(b"c")
        wait_until(lambda: port.read() == b"" and len(messages) == 5)
        assert second.recv(1) == b""
        assert re.fullmatch(r"turned away 127\.0\.0\.1:\d+: another client has the device", messages[3])
        for _ in range(4):  # it only receives, for longer than `idle_s`
            assert port.write(b"record")
            time.sleep(0.2)
        assert read_bytes(first.fileno(), 24) == b"record" * 4
        time.sleep(0.5)
        third.sendall(b"P")
        wait_until(lambda: port.read() == b"P")
        assert port.write(b"reply")
        assert read_bytes(third.fileno(), 5) == b"reply"
    port.close()


def test_an_overlong_command_is_rejected_over_tcp_too() -> None:
    with serve_emulator(make_samples(), tcp="127.0.0.1:0") as emulator, connect(emulator) as client:
        client.sendall(b"O1," + b"2," * 400 + b"1\r\nO1\r\n")
        assert read_bytes(client.fileno(), 131).endswith(b"EC -5*PS1  *FL1 *ST0\r\n21O 2 4 1\r\n")


def test_clients_beyond_the_greatest_number_are_turned_away() -> None:
    messages: list[str] = []
    port = TcpPort("127.0.0.1", 0, log=messages.append)
    address = ("127.0.0.1", int(port.name.rpartition(":")[2]))
    clients = []
    for number in range(1, MAX_CLIENTS + 2):
        clients.append(socket.create_connection(address, TIMEOUT_S))
        wait_until(lambda: port.read() == b"" and len(messages) >= number)  # noqa: B023  # called within the iteration
    assert clients[-1].recv(1) == b""
    assert messages[-1].startswith("turned away 127.0.0.1:")
    assert messages[-1].endswith(f"there are {MAX_CLIENTS} clients")
    for client in clients:
        client.close()
    wait_until(lambda: (port.read() == b"") and len(messages) == 2 * MAX_CLIENTS + 1)
    assert all(message.endswith(" gone") for message in messages[-MAX_CLIENTS:])
    port.close()


def test_a_tcp_client_that_does_not_read_is_dropped_and_stalls_nobody() -> None:
    messages: list[str] = []
    port = open_port(None, "127.0.0.1:0", log=messages.append)
    server = EmulatorServer(
        Emulator(make_samples(rate_hz=900.0, instants=900), EmulatorConfig(paced=False), time.monotonic()), port
    )
    thread = threading.Thread(target=server.run)
    thread.start()
    address = ("127.0.0.1", int(port.name.rpartition(":")[2]))
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    deaf.connect(address)
    try:
        deaf.sendall(SET_UP)
        wait_until(lambda: any("dropped" in message for message in messages))
        assert server.emulator.device.streaming
        with socket.create_connection(address, TIMEOUT_S) as client:
            client.sendall(b"c")
            wait_until(lambda: not server.emulator.device.streaming)
            client.sendall(b"O1\r")
            data = b""
            while not data.endswith(b"21O40 21121 1\r\n"):  # records may precede it
                data += read_bytes(client.fileno(), 1)
                assert len(data) < 1 << 20
    finally:
        server.stop()
        thread.join(TIMEOUT_S)
        deaf.close()
    (dropped,) = [message for message in messages if "dropped" in message]
    assert re.fullmatch(r"client 127\.0\.0\.1:\d+ dropped: it left \d+ bytes unread", dropped)


def test_other_computers_are_excluded_by_default() -> None:
    with pytest.raises(BadInput, match="--anywhere"):
        open_port(None, "0.0.0.0:0")
    port = open_port(None, "0.0.0.0:0", anywhere=True)
    assert port.name.startswith("tcp://0.0.0.0:")
    port.close()


@pytest.mark.parametrize("text", ["5005", "localhost", "127.0.0.1:", "127.0.0.1:99999", "127.0.0.1:x"])
def test_malformed_addresses_are_refused(text: str) -> None:
    with pytest.raises(BadInput, match="HOST:PORT"):
        open_port(None, text)


def test_exactly_one_port_is_required(link: Path) -> None:
    for ports in ((None, None), (link, "127.0.0.1:0")):
        with pytest.raises(BadInput, match="Name one"):
            open_port(*ports)


def test_records_are_written_at_the_pace_of_the_line(link: Path) -> None:
    sent: list[SentMessage] = []
    with serve_emulator(make_samples(), pty=link, on_sent=sent.append) as emulator:
        client = open_client(link)
        os.write(client, SET_UP)
        read_bytes(client, 38 * 200)
        os.close(client)
    summary = emulator.summary()
    records = [message for message in sent if message.message.station and not message.unread]
    due = [message.due_s for message in records]
    assert all(message.written_s >= message.due_s for message in records)
    assert all(b - a > 38 * 10 / 115200 - 1e-9 for a, b in itertools.pairwise(due))
    assert due[199] - due[0] == pytest.approx(199 / 200, abs=0.01)
    assert summary["records_sent"] == len(records)
    assert summary["pacing_max_ms"] >= summary["pacing_p99_ms"] >= summary["pacing_p50_ms"] >= 0.0


def test_waiting_uses_no_processor_time(link: Path) -> None:
    """Alone in a process: 2 s of silence."""
    code = f"""
import time
from harness.stream.emulators import serve_emulator
from tests.stream.is900.emulator.played import make_samples
with serve_emulator(make_samples(), pty={str(link)!r}):
    before = time.process_time()
    time.sleep(2.0)
    print(time.process_time() - before)
"""
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert float(process.stdout) < 0.2


def test_an_unplugged_tcp_port_listens_again_at_the_same_address() -> None:
    port = TcpPort("127.0.0.1", 0, log=lambda text: None)
    port.plug()
    name = port.name
    address = "127.0.0.1", int(name.rpartition(":")[2])
    port.unplug()
    assert (port.readable(), port.read()) == ([], b"")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(address, timeout=5.0)
    port.plug()
    try:
        assert port.name == name
        socket.create_connection(address, timeout=5.0).close()
    finally:
        port.close()
