"""Lines of bytes: serial ports (a pty stands in for one) and TCP, and the errors of opening one."""

import contextlib
import os
import socket
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial

from harness.errors import BadInput
from harness.stream.polhemus.driver.open_transport import open_transport
from harness.stream.polhemus.driver.serial_transport import PolledSerialTransport
from harness.stream.polhemus.driver.transport import LineLost, Transport, describe_io_error

TIMEOUT_S = 120.0


class PtyEnd:
    """The device's end of a pty behind a link."""

    def __init__(self, link: Path) -> None:
        self.name = str(link)
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._slave))

    def send(self, data: bytes) -> None:
        os.write(self.master, data)

    def receive(self) -> bytes:
        return os.read(self.master, 4096)

    def close(self) -> None:
        for descriptor in (self._slave, self.master):
            with contextlib.suppress(OSError):
                os.close(descriptor)


class TcpEnd:
    """A server with one client, which it greets as soon as it connects."""

    def __init__(self, greeting: bytes = b"") -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.name = f"tcp://127.0.0.1:{self._server.getsockname()[1]}"
        self._client: socket.socket | None = None
        self._greeting = greeting

    @property
    def client(self) -> socket.socket:
        if self._client is None:
            self._client, _ = self._server.accept()
            self._client.settimeout(TIMEOUT_S)
            self._client.sendall(self._greeting)
        return self._client

    def send(self, data: bytes) -> None:
        self.client.sendall(data)

    def receive(self) -> bytes:
        return self.client.recv(4096)

    def close(self) -> None:
        self._server.close()
        if self._client is not None:
            self._client.close()


End = PtyEnd | TcpEnd
PORT_KINDS = ["pty", "polled", "tcp"]


@pytest.fixture(params=PORT_KINDS)
def line(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[Transport, End]]:
    """The host's end and the device's end; `polled` is the transport of Windows."""
    end: End = TcpEnd() if request.param == "tcp" else PtyEnd(tmp_path / "port")
    if request.param == "polled":
        transport: Transport = PolledSerialTransport(
            end.name, serial.Serial(end.name, 115200, timeout=0, write_timeout=2.0)
        )
    else:
        transport = open_transport(end.name)
    yield transport, end
    transport.close()
    end.close()


def read_bytes(transport: Transport, size: int) -> bytes:
    out, until_s = b"", time.monotonic() + TIMEOUT_S
    while len(out) < size and time.monotonic() < until_s:
        out += transport.read(0.5)
    return out


def use_until_lost(transport: Transport) -> None:
    until_s = time.monotonic() + TIMEOUT_S
    while time.monotonic() < until_s:
        transport.read(0.05)
        transport.write(b"?")


def test_bytes_pass_both_ways_unchanged(line: tuple[Transport, End]) -> None:
    transport, end = line
    all_bytes = bytes(range(256)) * 4
    end.send(all_bytes)
    assert read_bytes(transport, len(all_bytes)) == all_bytes
    transport.write(all_bytes[:256])
    received = b""
    while len(received) < 256:
        received += end.receive()
    assert received == all_bytes[:256]


def test_a_read_keeps_its_timeout_and_takes_available_bytes(line: tuple[Transport, End]) -> None:
    transport, end = line
    began_s = time.monotonic()
    assert transport.read(0.05) == b""
    assert time.monotonic() - began_s >= 0.04
    end.send(b"a few bytes")
    assert read_bytes(transport, 11) == b"a few bytes"
    assert transport.read(0.0) == b""


def test_a_departed_peer_is_a_lost_line_after_all_was_read(line: tuple[Transport, End]) -> None:
    transport, end = line
    end.send(b"the last words")
    assert read_bytes(transport, 14) == b"the last words"
    end.close()
    with pytest.raises(LineLost, match=r"gone|closed"):
        use_until_lost(transport)


def test_closing_from_another_thread_ends_a_read_at_once(line: tuple[Transport, End]) -> None:
    transport, _ = line
    ended: list[float] = []

    def wait() -> None:
        with pytest.raises(LineLost, match="closed"):
            transport.read(TIMEOUT_S)
        ended.append(time.monotonic())

    thread = threading.Thread(target=wait)
    thread.start()
    time.sleep(0.05)
    transport.close()
    transport.close()
    thread.join(TIMEOUT_S)
    assert ended
    with pytest.raises(LineLost, match="closed"):
        transport.read(0.0)
    with pytest.raises(LineLost):
        transport.write(b"c")


def test_nothing_stays_open(tmp_path: Path) -> None:
    def descriptors() -> set[str]:
        return set(os.listdir("/proc/self/fd"))

    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("this system does not list open descriptors in /proc")
    before = descriptors()
    for make in (lambda: PtyEnd(tmp_path / "port"), TcpEnd):
        end: End = make()
        for _ in range(3):
            open_transport(end.name).close()
        end.close()
        with pytest.raises(BadInput):
            open_transport(str(tmp_path / "nowhere"))
    assert descriptors() == before


def test_bytes_sent_while_opening_and_before_closing_are_kept() -> None:
    end = TcpEnd(b"x" * 5000)
    accepting = threading.Thread(target=lambda: end.client)
    accepting.start()
    transport = open_transport(end.name)
    accepting.join(TIMEOUT_S)
    end.close()
    assert read_bytes(transport, 5000) == b"x" * 5000
    with pytest.raises(LineLost, match="closed by the other side"):
        transport.read(TIMEOUT_S)
    transport.close()


def test_socket_addresses_are_tcp_without_delay() -> None:
    end = TcpEnd()
    transport = open_transport(end.name.replace("tcp://", "socket://"))
    option = transport._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)  # type: ignore[attr-defined]
    assert option
    transport.close()
    end.close()


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (
            serial.SerialException("device reports readiness to read but returned no data (multiple access on port?)"),
            "the line is gone (unplugged, or closed by its other end)",
        ),
        (serial.SerialTimeoutException("Write timeout"), "the line takes no byte for 2 s"),
        (OSError(5, "Input/output error"), "the line is gone (Input/output error)"),
        (termios.error(5, "Input/output error"), "the line is gone (Input/output error)"),
        (ValueError("closed file"), "the line is gone (closed file)"),
        (OSError(), "the line is gone ()"),
    ],
)
def test_a_lost_line_is_told_in_one_clear_sentence(error: Exception, why: str) -> None:
    assert describe_io_error(error) == why


def test_a_pty_that_closes_is_a_lost_line(tmp_path: Path) -> None:
    end = PtyEnd(tmp_path / "port")
    transport = open_transport(end.name)
    end.close()
    with pytest.raises(LineLost) as lost:
        transport.read(TIMEOUT_S)
    assert lost.value.why == "the line is gone (unplugged, or closed by its other end)"
    transport.close()


def test_a_link_to_another_port_is_a_lost_line(tmp_path: Path) -> None:
    first_end = PtyEnd(tmp_path / "port")
    transport = open_transport(first_end.name)
    second_end = PtyEnd(tmp_path / "port")
    with pytest.raises(LineLost, match="another port"):
        transport.read(0.01)
    for end in (transport, first_end, second_end):
        end.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@pytest.mark.parametrize(
    ("port", "message"),
    [
        (lambda folder: str(folder / "nowhere"), "there is no such port"),
        (lambda folder: str(folder), "cannot be used as a serial port"),
        (lambda folder: "/dev/null", "cannot be used as a serial port"),
        (lambda folder: f"tcp://127.0.0.1:{free_port()}", "nothing listens at 127.0.0.1"),
        (lambda folder: "tcp://no..host:5005", "there is no host called no..host"),
        (lambda folder: "tcp://127.0.0.1", "host or port number is missing"),
        (lambda folder: "tcp://127.0.0.1:seven", "Write tcp://HOST:PORT"),
        (lambda folder: "tcp://127.0.0.1:99999", "Write tcp://HOST:PORT"),
        (lambda folder: "spy:///dev/ttyS0", "this kind of address is not known"),
        (lambda folder: "fastrak:", "Write fastrak:/dev/ttyUSB0, fastrak:COM3 or fastrak:tcp://HOST:PORT."),
        (lambda folder: "", "Write /dev/ttyUSB0, COM3 or tcp://HOST:PORT."),
    ],
)
def test_a_port_that_cannot_be_opened_is_named_with_a_remedy(
    port: Callable[[Path], str], message: str, tmp_path: Path
) -> None:
    port_name = port(tmp_path)
    with pytest.raises(BadInput) as raised:
        open_transport(port_name)
    assert message in str(raised.value)
    assert port_name in str(raised.value)
    assert raised.value.advice
    assert "\n" not in str(raised.value)


def test_an_unknown_host_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*args: object, **kwargs: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)  # tests must not query a name server
    with pytest.raises(BadInput, match="there is no host called tracker"):
        open_transport("tcp://tracker:5005")


def test_a_port_in_use_is_reported(tmp_path: Path) -> None:
    end = PtyEnd(tmp_path / "port")
    first = open_transport(end.name)
    with pytest.raises(BadInput, match="another program has it open"):
        open_transport(end.name)
    first.close()
    open_transport(end.name).close()
    end.close()


def test_a_port_without_permission_names_the_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    end = PtyEnd(tmp_path / "port")

    def refuse(path: str, *flags: int) -> int:
        raise PermissionError(13, "Permission denied", path)

    with monkeypatch.context() as patched:
        patched.setattr(os, "open", refuse)  # tests may run as root, who may open everything
        with pytest.raises(BadInput, match=r"permission denied\. Join the group"):
            open_transport(end.name)
    end.close()


def test_an_impossible_baud_rate_is_refused(tmp_path: Path) -> None:
    end = PtyEnd(tmp_path / "port")
    with pytest.raises(BadInput, match="-5 baud"):
        open_transport(end.name, -5)
    end.close()
