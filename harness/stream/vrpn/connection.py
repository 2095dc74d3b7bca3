"""A TCP connection to a VRPN server, for the messages of one of its trackers."""

import select
import socket
import struct
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

from harness.core.network import VRPN_PREFIX, resolve_host
from harness.errors import BadInput, HarnessError, shorten
from harness.stream.vrpn.messages import (
    COOKIE,
    DEFAULT_PORT,
    PING,
    PONG,
    POSE,
    SENDER_DESCRIPTION,
    TYPE_DESCRIPTION,
    MessageReader,
    NameTable,
    PoseReport,
    VrpnMessage,
    decode_pose,
    encode_description,
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

    @classmethod
    def parse(cls, text: str) -> "TrackerAddress":
        """Split such a text; BadInput for another one."""
        tracker, at, place = text.removeprefix(VRPN_PREFIX).rpartition("@")
        place = place.removeprefix("tcp://").removeprefix("tcp:")  # as VRPN's own programs write it
        host, colon, number = place.rpartition(":") if not place.endswith("]") else (place, "", "")
        if not colon:
            host, number = place, str(DEFAULT_PORT)
        sound = number.isascii() and number.isdecimal() and len(number) <= 5 and 0 < int(number) < 65536
        if not (at and tracker and host and sound and tracker.isprintable()):
            raise BadInput(f"Port {shorten(text)}: no tracker of a VRPN server.", _EXAMPLE)
        return cls(tracker, host.strip("[]"), int(number))


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
        self.received_bytes = 0
        self._address, self._types, self._reader = address, NameTable(), MessageReader()
        self._socket = _connect(address, timeout_s)
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
        try:
            if not select.select([self._socket], [], [], timeout_s)[0]:
                return
            data = self._socket.recv(_READ_BYTES)
        except (OSError, ValueError) as error:
            raise ConnectionLost(f"the connection is gone ({error})") from error
        if not data:
            raise ConnectionLost("the server has closed the connection")
        self.received_bytes += len(data)
        for message in self._reader.feed(data):
            if message.type == SENDER_DESCRIPTION:
                self.senders.add(message)
            elif message.type == TYPE_DESCRIPTION:
                self._types.add(message)
            elif message.type >= 0 and self.senders[message.sender] == self._address.tracker:
                kind = self._types[message.type]
                self.answered |= kind == PONG
                if kind == POSE:
                    yield decode_pose(message)

    def _send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise ConnectionLost(f"the connection is gone ({error})") from error

    def close(self) -> None:
        """Close the connection; may be called twice."""
        self._socket.close()


def _connect(address: TrackerAddress, timeout_s: float) -> socket.socket:
    """A connection to the first address of the host that answers; ConnectionLost with the first reason if none does."""
    reasons = []
    try:
        resolved = resolve_host(address.host, address.port, socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionLost(f"there is no host called {address.host}") from error
    for family, place in resolved:
        opened = socket.socket(family, socket.SOCK_STREAM)
        opened.settimeout(timeout_s)
        try:
            opened.connect(place)
        except OSError as error:
            opened.close()
            refused = isinstance(error, ConnectionRefusedError)
            reason = f"nothing listens at {address.host}, port {address.port}" if refused else str(error)
            reasons.append(f"{address.host} does not answer" if isinstance(error, TimeoutError) else reason)
        else:
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_ON_CLOSE)
            return opened
    raise ConnectionLost(reasons[0])
