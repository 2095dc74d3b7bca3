"""A device on a network: TCP with the bytes of its line, or UDP packets.

Sockets are our own: pyserial's `socket://` loses bytes that arrive while it opens and those already read when the peer
closes, and its `in_waiting` is only 0 or 1.
"""

import errno
import socket
from abc import abstractmethod
from urllib.parse import urlsplit

from harness.core.network import connect_tcp, describe_network_error, resolve_host
from harness.errors import BadInput
from harness.stream.polhemus.codec.datagram import DATAGRAM_START
from harness.stream.polhemus.driver.transport import READ_BYTES, WRITE_TIMEOUT_S, SelectTransport, Transport

UDP_SCHEME = "udp://"
MAX_PACKETS = 100
"""UDP packets that are read at once."""
CONNECT_TIMEOUT_S = 2.0
"""A host that does not answer for so long is unreachable [s]."""


def open_network(port: str) -> Transport:
    """Open `tcp://host:port`, `socket://host:port` or `udp://host:port`. Raises BadInput."""
    kind = {"tcp": _TcpTransport, "socket": _TcpTransport, "udp": _UdpTransport}.get(port.partition("://")[0])
    if kind is None:
        raise BadInput(
            f"Port {port}: this kind of address is not known.",
            "Name a serial port (/dev/ttyUSB0, COM3), tcp://HOST:PORT, socket://HOST:PORT or udp://HOST:PORT.",
        )
    address = _parse_network_address(port)
    try:
        return kind(port, *address)
    except (OSError, UnicodeError) as error:
        raise _network_error(port, address, error) from error


def _parse_network_address(port: str) -> tuple[str, int]:
    """Split `tcp://host:port` or `udp://host:port` into host and port number. Raises BadInput when one is missing."""
    example = (
        "udp://HOST:PORT, such as udp://127.0.0.1:5001"
        if port.startswith("udp:")
        else "tcp://HOST:PORT, such as tcp://127.0.0.1:5005"
    )
    try:
        parts = urlsplit(port)
        host, number = parts.hostname, parts.port
    except ValueError as error:
        raise BadInput(f"Port {port}: {error}.", f"Write {example}.") from error
    if not host or not number:
        raise BadInput(f"Port {port}: host or port number is missing.", f"Write {example}.")
    return host, number


def _network_error(port: str, address: tuple[str, int], error: Exception) -> BadInput:
    """Return the error for a host that could not be reached, or an address at which packets cannot be received."""
    if getattr(error, "errno", None) == errno.EADDRINUSE:
        what = f"another program receives at port {address[1]}"
        return BadInput(f"Port {port}: {what}.", "Close that program, or choose another port.")
    advice = "Check the address and the network."
    if isinstance(error, (socket.gaierror, UnicodeError)):
        advice = "Check the name, or give its address."
    elif isinstance(error, TimeoutError):
        advice = "Check the address, the cable and any firewall."
    elif isinstance(error, ConnectionRefusedError):
        advice = "Start the device (or `harness emulate`) first, and check the port number."
    elif port.startswith(UDP_SCHEME):
        advice = "Name an address of this computer: 127.0.0.1, or 0.0.0.0 for packets from the network."
    return BadInput(f"Port {port}: {describe_network_error(error, *address)}.", advice)


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
        opened = connect_tcp(host, port, CONNECT_TIMEOUT_S)
        opened.settimeout(WRITE_TIMEOUT_S)
        return opened

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
