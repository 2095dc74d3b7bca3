"""Lines of bytes: serial ports (a pty stands in for one) and TCP, and what is said when one cannot be opened."""

import contextlib
import os
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial

from harness.errors import BadInput
from harness.stream.driver.transport import LineLost, PolledSerialTransport, Transport, open_transport

PATIENT_S = 120.0


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
    """A server with one client, which says something the moment that it comes."""

    def __init__(self, greeting: bytes = b"") -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.name = f"tcp://127.0.0.1:{self._server.getsockname()[1]}"
        self._client: socket.socket | None = None
        self._greeting = greeting

    @property
    def client(self) -> socket.socket:
        if self._client is None:
            self._client, _ = self._server.accept()
            self._client.settimeout(PATIENT_S)
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
KINDS = ["pty", "polled", "tcp"]


@pytest.fixture(params=KINDS)
def line(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[Transport, End]]:
    """The host's end and the device's; `polled` is what Windows gets."""
    end: End = TcpEnd() if request.param == "tcp" else PtyEnd(tmp_path / "port")
    if request.param == "polled":
        ours: Transport = PolledSerialTransport(end.name, serial.Serial(end.name, 115200, timeout=0, write_timeout=2.0))
    else:
        ours = open_transport(end.name)
    yield ours, end
    ours.close()
    end.close()


def all_of(ours: Transport, size: int) -> bytes:
    out, until_s = b"", time.monotonic() + PATIENT_S
    while len(out) < size and time.monotonic() < until_s:
        out += ours.read(0.5)
    return out


def use(ours: Transport) -> None:
    until_s = time.monotonic() + PATIENT_S
    while time.monotonic() < until_s:
        ours.read(0.05)
        ours.write(b"?")


def test_bytes_go_both_ways_as_they_are(line: tuple[Transport, End]) -> None:
    ours, end = line
    every = bytes(range(256)) * 4
    end.send(every)
    assert all_of(ours, len(every)) == every
    ours.write(every[:256])
    heard = b""
    while len(heard) < 256:
        heard += end.receive()
    assert heard == every[:256]


def test_a_read_waits_no_longer_than_it_may_and_takes_what_is_there(line: tuple[Transport, End]) -> None:
    ours, end = line
    began_s = time.monotonic()
    assert ours.read(0.05) == b""
    assert time.monotonic() - began_s >= 0.04
    end.send(b"a few bytes")
    assert all_of(ours, 11) == b"a few bytes"
    assert ours.read(0.0) == b""


def test_an_end_that_goes_away_is_a_line_lost_after_all_was_read(line: tuple[Transport, End]) -> None:
    ours, end = line
    end.send(b"the last words")
    assert all_of(ours, 14) == b"the last words"
    end.close()
    with pytest.raises(LineLost, match=r"gone|closed"):
        use(ours)


def test_closing_from_another_thread_ends_a_read_at_once(line: tuple[Transport, End]) -> None:
    ours, _ = line
    ended: list[float] = []

    def wait() -> None:
        with pytest.raises(LineLost, match="closed"):
            ours.read(PATIENT_S)
        ended.append(time.monotonic())

    thread = threading.Thread(target=wait)
    thread.start()
    time.sleep(0.05)
    ours.close()
    ours.close()
    thread.join(PATIENT_S)
    assert ended
    with pytest.raises(LineLost, match="closed"):
        ours.read(0.0)
    with pytest.raises(LineLost):
        ours.write(b"c")


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


def test_what_the_peer_says_while_the_connection_opens_and_before_it_closes_is_kept() -> None:
    end = TcpEnd(b"x" * 5000)
    accepting = threading.Thread(target=lambda: end.client)
    accepting.start()
    ours = open_transport(end.name)
    accepting.join(PATIENT_S)
    end.close()
    assert all_of(ours, 5000) == b"x" * 5000
    with pytest.raises(LineLost, match="closed by the other side"):
        ours.read(PATIENT_S)
    ours.close()


def test_socket_is_tcp_and_small_packets_go_at_once() -> None:
    end = TcpEnd()
    ours = open_transport(end.name.replace("tcp://", "socket://"))
    option = ours._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)  # type: ignore[attr-defined]
    assert option
    ours.close()
    end.close()


def test_a_link_that_leads_elsewhere_is_a_line_lost(tmp_path: Path) -> None:
    one = PtyEnd(tmp_path / "port")
    ours = open_transport(one.name)
    other = PtyEnd(tmp_path / "port")
    with pytest.raises(LineLost, match="another port"):
        ours.read(0.01)
    for end in (ours, one, other):
        end.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@pytest.mark.parametrize(
    ("port", "says"),
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
    ],
)
def test_a_port_that_cannot_be_opened_is_named_with_what_to_try(
    port: Callable[[Path], str], says: str, tmp_path: Path
) -> None:
    named = port(tmp_path)
    with pytest.raises(BadInput) as raised:
        open_transport(named)
    assert says in str(raised.value)
    assert named in str(raised.value)
    assert raised.value.advice
    assert "\n" not in str(raised.value)


def test_a_host_that_nobody_knows_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*asked: object, **more: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)  # no test asks a name server
    with pytest.raises(BadInput, match="there is no host called tracker"):
        open_transport("tcp://tracker:5005")


def test_a_port_that_is_taken_says_so(tmp_path: Path) -> None:
    end = PtyEnd(tmp_path / "port")
    first = open_transport(end.name)
    with pytest.raises(BadInput, match="another program has it open"):
        open_transport(end.name)
    first.close()
    open_transport(end.name).close()
    end.close()


def test_a_port_that_may_not_be_opened_says_who_may(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    end = PtyEnd(tmp_path / "port")

    def refuse(path: str, *flags: int) -> int:
        raise PermissionError(13, "Permission denied", path)

    with monkeypatch.context() as patched:
        patched.setattr(os, "open", refuse)  # tests may run as root, whom nothing is forbidden
        with pytest.raises(BadInput, match=r"permission denied\. Join the group"):
            open_transport(end.name)
    end.close()


def test_a_rate_that_no_port_has_is_refused(tmp_path: Path) -> None:
    end = PtyEnd(tmp_path / "port")
    with pytest.raises(BadInput, match="-5 baud"):
        open_transport(end.name, -5)
    end.close()
