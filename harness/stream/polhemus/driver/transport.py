"""Transports: a serial port by pyserial, or TCP by a socket of our own. They carry bytes without interpretation.

pyserial's `socket://` loses bytes that arrive while it opens and those already read when the peer closes, and its
`in_waiting` is only 0 or 1. Therefore TCP does not use it, and no transport asks how many bytes are waiting: reads take
what is available. A read waits in `select` wherever the operating system can wait for a port, which is everywhere but
on Windows.
"""

import contextlib
import errno
import os
import select
import socket
import sys
import threading
import time
from abc import ABC, abstractmethod
from typing import Protocol
from urllib.parse import urlsplit

import serial
from serial.tools import list_ports

from harness.core.network import FASTRAK_PREFIX, resolve_host
from harness.errors import BadInput, HarnessError
from harness.stream.polhemus.codec.datagram import DATAGRAM_START
from harness.stream.polhemus.codec.items import BAUD_RATES

_BUSY_ERRNOS = (errno.EBUSY, errno.EAGAIN)
_TCP_EXAMPLE = "tcp://HOST:PORT, such as tcp://127.0.0.1:5005"
_BAUD_RATES_TEXT = f"{', '.join(map(str, BAUD_RATES[:-1]))} and {BAUD_RATES[-1]}"


def parse_network_address(port: str) -> tuple[str, int]:
    """Split `tcp://host:port` or `udp://host:port` into host and port number. Raises BadInput when one is missing."""
    example = "udp://HOST:PORT, such as udp://127.0.0.1:5001" if port.startswith("udp:") else _TCP_EXAMPLE
    try:
        parts = urlsplit(port)
        host, number = parts.hostname, parts.port
    except ValueError as error:
        raise BadInput(f"Port {port}: {error}.", f"Write {example}.") from error
    if not host or not number:
        raise BadInput(f"Port {port}: host or port number is missing.", f"Write {example}.")
    return host, number


def network_error(port: str, address: tuple[str, int], error: Exception) -> BadInput:
    """Return the error for a host that could not be reached, or an address at which packets cannot be received."""
    host, number = address
    if isinstance(error, (socket.gaierror, UnicodeError)):
        return BadInput(f"Port {port}: there is no host called {host}.", "Check the name, or give its address.")
    if isinstance(error, TimeoutError):
        return BadInput(f"Port {port}: {host} does not answer.", "Check the address, the cable and any firewall.")
    if isinstance(error, ConnectionRefusedError):
        return BadInput(
            f"Port {port}: nothing listens at {host}, port {number}.",
            "Start the device (or `harness emulate`) first, and check the port number.",
        )
    if getattr(error, "errno", None) == errno.EADDRINUSE:
        return BadInput(
            f"Port {port}: another program receives at port {number}.", "Close that program, or choose another port."
        )
    advice = "Check the address and the network."
    if port.startswith(UDP_SCHEME):
        advice = "Name an address of this computer: 127.0.0.1, or 0.0.0.0 for packets from the network."
    return BadInput(f"Port {port}: {_error_text(error)}.", advice)


def serial_port_error(port: str, baud: int, error: Exception) -> BadInput:
    """Return the error for a serial port that could not be opened."""
    number = getattr(error, "errno", None)
    if isinstance(error, ValueError):
        return BadInput(f"Port {port} at {baud} baud: {error}.", f"The device uses {_BAUD_RATES_TEXT}.")
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV) or isinstance(error, FileNotFoundError):
        ports = ", ".join(sorted(known.device for known in list_ports.comports())) or "none"
        return BadInput(f"Port {port}: there is no such port.", f"Serial ports of this computer: {ports}.")
    if number == errno.EACCES and os.name == "posix":
        return BadInput(
            f"Port {port}: permission denied.",
            f"Join the group that may open it ({_owner_group(port)}), then log in again.",
        )
    if number in (*_BUSY_ERRNOS, errno.EACCES):
        return BadInput(f"Port {port}: another program has it open.", "Close that program; only one may use the port.")
    if os.path.isfile(port):
        return BadInput(f"Port {port}: a file, not a port.", "Name the port of the device, such as /dev/ttyUSB0.")
    return BadInput(
        f"Port {port} cannot be used as a serial port: {_error_text(error)}.", "Name the port of the device."
    )


def _error_text(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def _owner_group(port: str) -> str:
    """Return the group that owns a port file, or a guess where that cannot be determined."""
    try:
        import grp

        return grp.getgrgid(os.stat(port).st_gid).gr_name
    except (ImportError, KeyError, OSError):
        return "often dialout"


if sys.platform == "win32":
    _IO_ERRORS: tuple[type[Exception], ...] = (OSError, ValueError)
else:
    import termios

    _IO_ERRORS = (OSError, ValueError, termios.error)
UDP_SCHEME = "udp://"
READ_BYTES = 65536
"""More than any operating system buffers for a port [bytes]."""
MAX_PACKETS = 100
"""UDP packets that are read at once."""
WRITE_TIMEOUT_S, CONNECT_TIMEOUT_S = 2.0, 2.0
"""A line that takes no byte for so long is lost; a host that does not answer for so long is unreachable [s]."""
_POLL_INTERVAL_S = 0.002
"""Interval between two reads of a port that cannot be waited for [s]."""


class LineLost(HarnessError):
    """The line is gone: unplugged, closed by the other side, or closed by this program."""

    def __init__(self, port: str, why: str) -> None:
        super().__init__(port, why)
        self.port, self.why = self.args

    def __str__(self) -> str:
        return f"{self.port}: {self.why}."


class Transport(Protocol):
    """Interface of an open line. One thread reads; another may write or close meanwhile."""

    @property
    def name(self) -> str:
        """The port as the user named it."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Return the available bytes, after a wait of at most `timeout_s` for the first one; b"" when none arrives.

        Raises LineLost when nothing can arrive any more.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all bytes. Raises LineLost when the line does not take them."""
        ...

    def close(self) -> None:
        """Close the line. May be called twice, and while another thread reads: its read raises LineLost."""
        ...


def open_transport(port: str, baud: int = 115200) -> Transport:
    """Open `/dev/ttyUSB0`, `COM3`, a pty, `tcp://host:port`, `socket://host:port` or `udp://host:port`.

    `fastrak:` before any of them names the device there and opens the same. A serial port is opened for this process
    alone: 8N1, no handshake, as every IS-900 client does (docs/is900.md 2).
    Raises BadInput when there is no such port or host, or when it is in use or may not be opened.
    """
    port = port.removeprefix(FASTRAK_PREFIX)
    kind = {"tcp": _TcpTransport, "socket": _TcpTransport, "udp": _UdpTransport}.get(port.partition("://")[0])
    if "://" in port and kind is not None:
        address = parse_network_address(port)
        try:
            return kind(port, *address)
        except (OSError, UnicodeError) as error:
            raise network_error(port, address, error) from error
    if "://" in port:
        raise BadInput(
            f"Port {port}: this kind of address is not known.",
            "Name a serial port (/dev/ttyUSB0, COM3), tcp://HOST:PORT, socket://HOST:PORT or udp://HOST:PORT.",
        )
    try:
        opened = serial.Serial(port, baud, timeout=0, write_timeout=WRITE_TIMEOUT_S, exclusive=True)
    except _IO_ERRORS as error:
        raise serial_port_error(port, baud, error) from error
    return PolledSerialTransport(port, opened) if sys.platform == "win32" else SelectSerialTransport(port, opened)


class _BaseTransport(ABC):
    """Shared part of all transports: one reader at a time, and a close that the reader notices."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._reading = threading.RLock()
        self._closed = threading.Event()

    def read(self, timeout_s: float) -> bytes:
        with self._reading:
            try:
                data = b"" if self._closed.is_set() else self._receive(timeout_s)
            except _IO_ERRORS as error:
                raise LineLost(self.name, self._reason(error)) from error
            if self._closed.is_set():
                raise LineLost(self.name, "closed")
            return data

    def write(self, data: bytes) -> None:
        try:
            self._send(data)
        except _IO_ERRORS as error:
            raise LineLost(self.name, self._reason(error)) from error

    def close(self) -> None:
        self._closed.set()
        self._wake()
        with self._reading:
            self._release()

    def _reason(self, error: Exception) -> str:
        return "closed" if self._closed.is_set() else f"the line is gone ({error})"

    @abstractmethod
    def _receive(self, timeout_s: float) -> bytes:
        """Return the bytes that are available after a wait of at most `timeout_s` [s]."""

    @abstractmethod
    def _send(self, data: bytes) -> None: ...

    def _wake(self) -> None:  # noqa: B027  # the default does nothing: short waits need no waking
        """End the wait of another thread."""

    @abstractmethod
    def _release(self) -> None: ...


class SelectTransport(_BaseTransport):
    """A transport whose file descriptor can be waited for."""

    def __init__(self, name: str, descriptor: int) -> None:
        super().__init__(name)
        self.descriptor = descriptor
        """What `select` and `poll` wait for."""
        self._woken, self._waker = socket.socketpair()

    def _receive(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self.descriptor, self._woken.fileno()], [], [], max(timeout_s, 0.0))
        if self.descriptor in ready:
            return self._take()
        self._check_alive()
        return b""

    def set_baud(self, baud: int) -> None:
        """Set the baud rate of an open serial port [bit/s]; without effect on other lines. Raises LineLost."""

    @abstractmethod
    def _take(self) -> bytes:
        """Return the available bytes, of which there is at least one."""

    def _check_alive(self) -> None:  # a socket reports a lost peer by itself
        """Called when nothing arrived; raises OSError when nothing can arrive any more."""

    def _wake(self) -> None:
        with contextlib.suppress(OSError):  # closed already
            self._waker.send(b"x")

    def _release(self) -> None:
        self._woken.close()
        self._waker.close()


class SelectSerialTransport(SelectTransport):
    """A serial port that the operating system can wait for."""

    def __init__(self, name: str, port: serial.Serial) -> None:
        super().__init__(name, port.fileno())
        self._port = port

    def set_baud(self, baud: int) -> None:
        try:
            self._port.baudrate = baud
        except _IO_ERRORS as error:
            raise LineLost(self.name, self._reason(error)) from error

    def _take(self) -> bytes:
        return bytes(self._port.read(READ_BYTES))

    def _check_alive(self) -> None:
        if os.stat(self.name).st_rdev != os.fstat(self.descriptor).st_rdev:
            raise OSError("the name belongs to another port now")

    def _send(self, data: bytes) -> None:
        self._port.write(data)

    def _release(self) -> None:
        self._port.close()
        super()._release()


class PolledSerialTransport(_BaseTransport):
    """A serial port on Windows, polled every 2 ms."""

    def __init__(self, name: str, port: serial.Serial) -> None:
        super().__init__(name)
        self._port = port

    def _receive(self, timeout_s: float) -> bytes:
        until_s = time.monotonic() + timeout_s
        while True:
            data = bytes(self._port.read(READ_BYTES))
            if data or time.monotonic() >= until_s or self._closed.wait(_POLL_INTERVAL_S):
                return data

    def _send(self, data: bytes) -> None:
        self._port.write(data)

    def _release(self) -> None:
        self._port.close()


class _SocketTransport(SelectTransport):
    """A socket of our own. Making one raises OSError, and UnicodeError for a name that no host can have."""

    def __init__(self, name: str, host: str, port: int) -> None:
        self._socket = self._open(host, port)
        super().__init__(name, self._socket.fileno())

    @staticmethod
    @abstractmethod
    def _open(host: str, port: int) -> socket.socket: ...

    def _release(self) -> None:
        self._socket.close()
        super()._release()


class _TcpTransport(_SocketTransport):
    """A TCP connection that sends small packets at once."""

    @staticmethod
    def _open(host: str, port: int) -> socket.socket:
        """A connection to the first address of the host that answers; OSError of the first one if none does."""
        errors = []
        for family, resolved in resolve_host(host, port, socket.SOCK_STREAM):
            opened = socket.socket(family, socket.SOCK_STREAM)
            opened.settimeout(CONNECT_TIMEOUT_S)
            try:
                opened.connect(resolved)
            except OSError as error:
                opened.close()
                errors.append(error)
            else:
                opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                opened.settimeout(WRITE_TIMEOUT_S)
                return opened
        raise errors[0]

    def _take(self) -> bytes:
        data = self._socket.recv(READ_BYTES)
        if not data:
            raise OSError("closed by the other side")
        return data

    def _send(self, data: bytes) -> None:
        self._socket.sendall(data)


class _UdpTransport(_SocketTransport):
    """Packets that are sent to an address of this computer; it sends nothing.

    The host that first sends station data is the tracker. Packets of other hosts are left out.
    """

    _sender = ""

    @staticmethod
    def _open(host: str, port: int) -> socket.socket:
        family, resolved = resolve_host(host, port, socket.SOCK_DGRAM)[0]
        opened = socket.socket(family, socket.SOCK_DGRAM)
        try:
            opened.bind(resolved)
        except OSError:
            opened.close()
            raise
        opened.setblocking(False)
        return opened

    def _take(self) -> bytes:
        """Return the packets that have arrived, one after another."""
        packets: list[bytes] = []
        while len(packets) < MAX_PACKETS:
            try:
                packet, (host, *_) = self._socket.recvfrom(READ_BYTES)
            except BlockingIOError:
                break
            if not self._sender and packet.startswith(DATAGRAM_START):
                self._sender = host
            packets += [packet] if host == self._sender else []
        return b"".join(packets)

    def _send(self, data: bytes) -> None:
        raise OSError("packets carry no commands")
