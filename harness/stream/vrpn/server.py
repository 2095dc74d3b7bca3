"""A VRPN server of poses: any VRPN client sees its trackers.

It has one thread, which takes connections and writes. A client connects by TCP, or asks by a UDP packet that the server
connect to it, as VRPN's own programs do. Reports go by TCP alone, so that none is lost. Source: vrpn_Connection.C of
github.com/vrpn/vrpn.
"""

import contextlib
import errno
import select
import socket
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from harness.core.network import LOOPBACK, check_loopback
from harness.core.number_format import count_noun
from harness.stream.client_socket import MAX_CLIENTS
from harness.stream.vrpn.listening import open_listeners, parse_served_name
from harness.stream.vrpn.messages import (
    DEFAULT_PORT,
    PING,
    PONG,
    POSE,
    SENDER_DESCRIPTION,
    TYPE_DESCRIPTION,
    MalformedMessage,
    PoseReport,
    VrpnMessage,
    encode_description,
)
from harness.stream.vrpn.served_client import ServedClient

MAX_UNREAD_BYTES = 8 << 20
"""A client that leaves so much unread is disconnected: it would otherwise miss reports without noticing [bytes]."""
DRAIN_S = 2.0
"""Longest wait at the end for clients that still read [s]."""
_TYPES = (POSE, PING, PONG)
_READ_BYTES = 1 << 16
_LONGEST_REQUEST_BYTES = 200
_LEAST_PORT = 1024
"""Least port that a request may name: those below belong to the system."""

LogCallback = Callable[[str], None]


def open_server(
    place: str, suffixes: Sequence[str] = ("",), *, anywhere: bool = False, log: LogCallback = lambda line: None
) -> "VrpnServer":
    """Open the server that `--vrpn NAME[@[HOST:]PORT]` asks for, with a tracker NAME + suffix each. Raises BadInput."""
    name, host, port = parse_served_name(place)
    return VrpnServer([name + suffix for suffix in suffixes], host, port, anywhere=anywhere, log=log)


class VrpnServer:
    """Serves poses under the names of trackers until it is closed. `send` may be called from any thread."""

    def __init__(
        self,
        trackers: Sequence[str],
        host: str = LOOPBACK,
        port: int = DEFAULT_PORT,
        *,
        anywhere: bool = False,
        log: LogCallback = lambda line: None,
    ) -> None:
        """Listen; port 0 takes a free one. Raises BadInput for a port in use, or reachable without `anywhere`."""
        check_loopback(host, anywhere, "anyone who reaches the port then sees the poses")
        self.trackers, self._log = tuple(trackers), log
        self._clients: list[ServedClient] = []
        self._lock = threading.Lock()
        """Held while the clients or what they have to be sent change."""
        self._tcp, self._udp = open_listeners(host, port)
        self.port = int(self._tcp.getsockname()[1])
        self._woken, self._waker = socket.socketpair()
        self._woken.setblocking(False)
        self._waker.setblocking(False)
        self._stopped = False
        self._connected = threading.Event()
        self.sent = 0
        """Number of reports that were handed to all clients."""
        self._host = host
        self._thread = threading.Thread(target=self._run, name="vrpn server", daemon=True)
        self._thread.start()

    @property
    def names(self) -> tuple[str, ...]:
        """What clients open: `Tracker0@127.0.0.1:3883`."""
        return tuple(f"{tracker}@{self._host}:{self.port}" for tracker in self.trackers)

    @property
    def clients(self) -> int:
        """Number of clients that receive reports."""
        with self._lock:
            return sum(client.greeted for client in self._clients)

    def wait_for_client(self, timeout_s: float) -> bool:
        """Wait until the first client is there, at most `timeout_s` [s]; whether one is."""
        return self._connected.wait(timeout_s)

    def send(self, tracker: str, reports: Iterable[PoseReport]) -> None:
        """Send reports of a tracker to all clients; never blocks."""
        sender = self.trackers.index(tracker)
        messages = [report.encode(_TYPES.index(POSE), sender) for report in reports]
        with self._lock:
            for client in self._clients:
                if client.greeted:
                    client.add(*messages)
            self.sent += len(messages)
        if messages:
            self._wake()

    def close(self) -> None:
        """End the server, after clients have read what was sent, or `DRAIN_S`; may be called twice."""
        self._stopped = True
        self._wake()
        self._thread.join()

    def __enter__(self) -> "VrpnServer":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _wake(self) -> None:
        with contextlib.suppress(OSError):  # full, so that the thread wakes anyway; or closed
            self._waker.send(b"x")

    def _run(self) -> None:
        until_s = None
        try:
            while True:
                if self._stopped:
                    until_s = until_s or time.monotonic() + DRAIN_S
                    if time.monotonic() > until_s or not any(client.unsent for client in self._clients):
                        return
                self._serve_once()
        finally:
            with self._lock:
                ends: list[Any] = [*self._clients, self._tcp, self._udp, self._woken, self._waker]
                for end in ends:
                    end.close()
                self._clients = []

    def _serve_once(self) -> None:
        """Wait for bytes, clients or room, and process them."""
        with self._lock:
            writers = [client for client in self._clients if client.unsent]
            ends: list[Any] = [self._tcp, self._udp, self._woken, *self._clients]
        ready, free, _ = select.select(ends, writers, [], 0.1 if self._stopped else 1.0)
        if self._woken in ready:
            self._woken.recv(_READ_BYTES)
        if self._tcp in ready:
            self._accept()
        if self._udp in ready:
            self._answer_request()
        for client in [end for end in ready if isinstance(end, ServedClient)]:
            self._read(client)
        with self._lock:
            for client in free:
                client.flush()
            for client in self._clients:
                if len(client.unsent) > MAX_UNREAD_BYTES:
                    client.gone = f"it left {len(client.unsent) >> 20} MB unread"
            gone = [client for client in self._clients if client.gone]
            self._clients = [client for client in self._clients if not client.gone]
        for client in gone:
            client.close()
            self._log(f"VRPN client {client.name} is gone: {client.gone}")

    def _accept(self) -> None:
        with contextlib.suppress(OSError):  # gone already
            opened, place = self._tcp.accept()
            self._add(opened, place)

    def _answer_request(self) -> None:
        """Connect to the client that asks for it, at the address from which the packet came."""
        try:
            packet, place = self._udp.recvfrom(_LONGEST_REQUEST_BYTES)
        except OSError:
            return
        words = packet.split(b"\0")[0].split()
        number = words[1] if len(words) == 2 else b""
        if not number.isdigit() or len(number) > 5 or not _LEAST_PORT <= int(number) < 65536:
            return
        target = (place[0], int(number), *place[2:])
        if any(client.place == target for client in self._clients):
            return
        opened = socket.socket(self._udp.family, socket.SOCK_STREAM)
        opened.setblocking(False)
        if opened.connect_ex(target) in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            self._add(opened, target)
        else:
            opened.close()

    def _add(self, opened: socket.socket, place: Any) -> None:
        if len(self._clients) >= MAX_CLIENTS:
            opened.close()
            self._log(f"VRPN client {place[0]} is turned away: {count_noun(MAX_CLIENTS, 'client')} are there")
            return
        with self._lock:
            self._clients.append(ServedClient(opened, place))

    def _read(self, client: ServedClient) -> None:
        """Process what a client sends: its names, and pings, which are answered."""
        try:
            for message in client.messages():
                if message.type == SENDER_DESCRIPTION:
                    client.senders.add(message)
                elif message.type == TYPE_DESCRIPTION:
                    client.types.add(message)
                elif message.type >= 0 and client.types[message.type] == PING:
                    name = client.senders[message.sender]
                    if name in self.trackers:
                        pong = VrpnMessage(_TYPES.index(PONG), self.trackers.index(name), _now_us())
                        with self._lock:
                            client.add(pong)
        except MalformedMessage as error:
            client.gone = f"it sent what is no message of VRPN: {error.problem}"
        if client.reader.greeted and not client.greeted and not client.gone:
            self._greet(client)

    def _greet(self, client: ServedClient) -> None:
        """Describe the trackers and types to a client; from now on it gets the reports."""
        now_us = _now_us()
        names = [(SENDER_DESCRIPTION, number, name) for number, name in enumerate(self.trackers)]
        names += [(TYPE_DESCRIPTION, number, name) for number, name in enumerate(_TYPES)]
        with self._lock:
            client.add(*(encode_description(*name, now_us) for name in names))
            client.greeted = True
        self._connected.set()
        self._log(f"VRPN client {client.name} is connected")


def _now_us() -> int:
    return time.time_ns() // 1000
