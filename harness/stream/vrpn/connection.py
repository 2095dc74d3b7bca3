"""A connection to a VRPN server, for the messages of one of its trackers.

The client connects by TCP, and everything comes that way. Of `udp://` it asks the server to connect to it, as VRPN's
own programs do; a server then offers UDP, and sends reports so. Source: vrpn_Connection.C of github.com/vrpn/vrpn.
"""

import select
import socket
import struct
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

from harness.core.network import VRPN_PREFIX, connect_tcp, describe_network_error, resolve_host
from harness.errors import BadInput, HarnessError, shorten
from harness.stream.vrpn.messages import (
    COOKIE,
    DEFAULT_PORT,
    PING,
    PONG,
    POSE,
    SENDER_DESCRIPTION,
    TYPE_DESCRIPTION,
    UDP_DESCRIPTION,
    MessageReader,
    NameTable,
    PoseReport,
    VrpnMessage,
    decode_pose,
    encode_description,
    split_datagram,
)

_EXAMPLE = "Write vrpn:TRACKER@HOST[:PORT], such as vrpn:Tracker0@127.0.0.1:3883."
_TYPES = (POSE, PING, PONG)
_READ_BYTES = 1 << 16
_RESET_ON_CLOSE = struct.pack("hh" if sys.platform == "win32" else "ii", 1, 0)
"""Value of SO_LINGER. VRPN's server cannot listen again while an old connection waits at its port, up to a minute after
it has ended; a reset ends that wait.
"""


@dataclass(frozen=True)
class TrackerAddress:
    """A tracker of a VRPN server, as `vrpn:Tracker0@host:port` names it."""

    tracker: str
    host: str
    port: int = DEFAULT_PORT
    udp: bool = False
    """Whether reports come by UDP where the server offers it."""

    @classmethod
    def parse(cls, text: str) -> "TrackerAddress":
        """Split such a text; BadInput for another one."""
        tracker, at, place = text.removeprefix(VRPN_PREFIX).rpartition("@")
        udp = place.startswith("udp://")
        place = place.removeprefix("udp://" if udp else "tcp://")  # VRPN's own programs write the latter
        host, colon, number = place.rpartition(":") if not place.endswith("]") else (place, "", "")
        if not colon:
            host, number = place, str(DEFAULT_PORT)
        sound = number.isascii() and number.isdecimal() and len(number) <= 5 and 0 < int(number) < 65536
        if not (at and tracker and host and sound and tracker.isprintable()) or "/" in host:
            raise BadInput(f"Port {shorten(text)}: no tracker of a VRPN server.", _EXAMPLE)
        return cls(tracker, host.strip("[]"), int(number), udp)


class ConnectionLost(HarnessError):
    """The connection to the server is gone, or was never made."""

    def __init__(self, why: str) -> None:
        super().__init__(why)
        (self.why,) = self.args

    def __str__(self) -> str:
        return f"{self.why}."


class ServerConnection:
    """An open connection. Raises ConnectionLost when the server is gone, MalformedMessage when it sends no VRPN."""

    def __init__(self, address: TrackerAddress, timeout_s: float) -> None:
        self.senders = NameTable()
        self.answered = False
        """Whether the tracker has answered a ping: the server has it."""
        self.received_bytes = self.lost_messages = 0
        """Number of bytes so far, and of messages that UDP has lost."""
        self._datagrams: socket.socket | None = None
        """What receives reports by UDP, after the server has offered it."""
        self._sequence: int | None = None
        self._address, self._types, self._reader = address, NameTable(), MessageReader()
        self._socket = _be_connected(address, timeout_s) if address.udp else _connect(address, timeout_s)
        now_us = time.time_ns() // 1000
        names = [encode_description(SENDER_DESCRIPTION, 0, address.tracker, now_us)]
        names += [encode_description(TYPE_DESCRIPTION, number, name, now_us) for number, name in enumerate(_TYPES)]
        try:
            self._send(COOKIE + b"".join(message.encode() for message in names))
            self.ping()
        except ConnectionLost:
            self.close()
            raise

    @property
    def greeted(self) -> bool:
        """Whether the other side has shown that it is a VRPN server."""
        return self._reader.greeted

    def ping(self) -> None:
        """Ask the tracker whether it is there."""
        self._send(VrpnMessage(_TYPES.index(PING), 0, time.time_ns() // 1000).encode())

    def receive(self, timeout_s: float) -> Iterator[PoseReport]:
        """Yield the tracker's reports that are there, after a wait of at most `timeout_s` for bytes [s]."""
        for message in self._messages(timeout_s):
            if message.type == SENDER_DESCRIPTION:
                self.senders.add(message)
            elif message.type == TYPE_DESCRIPTION:
                self._types.add(message)
            elif message.type == UDP_DESCRIPTION and self._address.udp:
                self._accept_udp()
            elif message.type >= 0 and self.senders[message.sender] == self._address.tracker:
                kind = self._types[message.type]
                self.answered |= kind == PONG
                if kind == POSE:
                    yield decode_pose(message)

    def _messages(self, timeout_s: float) -> Iterator[VrpnMessage]:
        ends = [self._socket] if self._datagrams is None else [self._socket, self._datagrams]
        try:
            ready = select.select(ends, [], [], timeout_s)[0]
            packets = [] if self._datagrams not in ready else [self._datagrams.recvfrom(_READ_BYTES)]
            data = self._socket.recv(_READ_BYTES) if self._socket in ready else None
        except (OSError, ValueError) as error:
            raise _gone(error) from error
        if data == b"":
            raise ConnectionLost("the server has closed the connection")
        if data:
            self.received_bytes += len(data)
            yield from self._reader.feed(data)
        for packet, (host, *_) in packets:
            if host == self._socket.getpeername()[0]:
                self.received_bytes += len(packet)
                for message in split_datagram(packet):
                    if self._sequence is not None:
                        self.lost_messages += message.sequence - self._sequence - 1
                    self._sequence = message.sequence
                    yield message

    def _accept_udp(self) -> None:
        """Tell the server where it can send reports by UDP."""
        if self._datagrams is not None:
            return
        host = self._socket.getsockname()[0]
        self._datagrams = socket.socket(self._socket.family, socket.SOCK_DGRAM)
        self._datagrams.bind((host, 0))
        port = self._datagrams.getsockname()[1]
        self._send(VrpnMessage(UDP_DESCRIPTION, port, time.time_ns() // 1000, host.encode() + b"\0").encode())

    def _send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise _gone(error) from error

    def close(self) -> None:
        """Close the connection; may be called twice."""
        self._socket.close()
        if self._datagrams is not None:
            self._datagrams.close()


def _gone(error: OSError | ValueError) -> ConnectionLost:
    return ConnectionLost(f"the connection is gone ({getattr(error, 'strerror', None) or error})")


def _connect(address: TrackerAddress, timeout_s: float) -> socket.socket:
    """A connection to the first address of the host that answers; ConnectionLost with the reason if none does."""
    try:
        return _prepare(connect_tcp(address.host, address.port, timeout_s), timeout_s)
    except (OSError, UnicodeError) as error:
        raise ConnectionLost(describe_network_error(error, address.host, address.port)) from error


def _be_connected(address: TrackerAddress, timeout_s: float) -> socket.socket:
    """The connection that the server makes to this computer when a packet asks it to. Raises ConnectionLost."""
    try:
        family, place = resolve_host(address.host, address.port, socket.SOCK_DGRAM)[0]
    except (OSError, UnicodeError) as error:
        raise ConnectionLost(describe_network_error(error, address.host, address.port)) from error
    with socket.socket(family, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(place)
            host = asking.getsockname()[0]
            with socket.create_server((host, 0), family=family) as listening:
                listening.settimeout(timeout_s)
                asking.send(f"{host} {listening.getsockname()[1]}\0".encode())
                while True:
                    opened, (peer, *_) = listening.accept()
                    if peer == place[0]:
                        return _prepare(opened, timeout_s)
                    opened.close()
        except TimeoutError as error:
            raise ConnectionLost(f"{address.host} does not connect to this computer, which it was asked to") from error
        except OSError as error:
            raise ConnectionLost(f"{address.host} cannot be asked ({error.strerror or error})") from error


def _prepare(opened: socket.socket, timeout_s: float) -> socket.socket:
    opened.settimeout(timeout_s)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_ON_CLOSE)
    return opened
