"""Ports at which a client finds an emulator: their interface, and TCP with the bytes of the serial line
(docs/is900.md 9).
"""

import socket
import time
from collections.abc import Callable
from typing import Protocol

from harness.core.network import check_loopback, resolve_host
from harness.errors import BadInput
from harness.stream.client_socket import MAX_CLIENTS, ClientSocket
from harness.stream.polhemus.codec.commands import CommandReader


class Port(Protocol):
    """The client's end of a line. A client may come and go."""

    @property
    def name(self) -> str:
        """The name that a client opens."""
        ...

    def readable(self) -> list[int]:
        """Return the descriptors to wait for bytes or clients from."""
        ...

    def writable(self) -> list[int]:
        """Return the descriptors that must take the rest of a message."""
        ...

    def read(self) -> bytes:
        """Return the bytes that have arrived, without waiting."""
        ...

    def write(self, data: bytes) -> bool:
        """Send all of the data sooner or later, or nothing.

        Returns False when the client is absent or leaves no room.
        """
        ...

    def baud(self) -> int | None:
        """Return the baud rate that the client has set [bit/s]; None where there is none."""
        ...

    def unplug(self) -> None:
        """Make the port unusable for the client, as if the cable were pulled out."""
        ...

    def plug(self) -> None:
        """Make the port usable again; no effect if it is usable."""
        ...

    def close(self) -> None:
        """Release the port for good."""
        ...


MAX_UNREAD_BYTES = 1 << 16
"""Bytes that wait here for a client, beyond those in the operating system's buffers: six seconds of a full line of
115200 baud [bytes]."""
_SEND_BUFFER_BYTES = 1 << 16


class TcpClient(ClientSocket):
    """One connection. A command that the client has not finished disturbs no other client."""

    def __init__(self, connection: socket.socket, name: str) -> None:
        super().__init__(connection, name)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        self._commands = CommandReader()

    def read(self) -> bytes:
        """Return the commands that have become complete."""
        return b"".join(command.encode() for command in self._commands.feed(self.receive()))

    def write(self, data: bytes) -> None:
        """Send bytes, or keep them until the client reads."""
        self.unsent += data
        self.flush()


LogCallback = Callable[[str], None]
"""Receives one line of text for the user."""
IDLE_S = 5.0
"""A client keeps the device until it has sent and received nothing for this long [s] [choice]."""


class TcpPort:
    """A TCP port. Of its clients, the one that sends a command gets the device, until it leaves or is idle.

    An idle client keeps nobody out. Another that sends a command meanwhile is turned away, so that two programs do not
    change each other's settings. A client that does not read is dropped when its queue is full.
    """

    def __init__(
        self,
        host: str,
        port: int,
        *,
        anywhere: bool = False,
        log: LogCallback = lambda line: None,
        idle_s: float = IDLE_S,
    ) -> None:
        """Listen at this address. Raises BadInput when it is taken, or reachable by others without `anywhere`."""
        check_loopback(host, anywhere, "anyone who reaches the port can then command the emulator")
        self._log, self._idle_s = log, idle_s
        self._clients: list[TcpClient] = []
        self._user: TcpClient | None = None
        """The client that has the device."""
        self._used_s = float("-inf")
        """When that client last sent or received something [s]."""
        self._server: socket.socket | None = None
        self._address = host, port
        self.plug()

    @property
    def name(self) -> str:
        host, port = self._address
        return f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"

    def readable(self) -> list[int]:
        ends: list[socket.socket | TcpClient] = [] if self._server is None else [self._server]
        return [end.fileno() for end in (*ends, *self._clients)]

    def writable(self) -> list[int]:
        return [client.fileno() for client in self._clients if client.unsent]

    def read(self) -> bytes:
        for client in self._clients:
            client.flush()
        user_first = sorted(self._clients, key=lambda client: client is not self._user)  # it may have left
        data = b"".join(self._read_from(client) for client in user_first)
        self._drop_clients()  # before others are accepted: the same client may be reconnecting
        self._accept_clients()
        return data

    def write(self, data: bytes) -> bool:
        if self._user is None:
            return False
        self._user.write(data)
        self._used_s = time.monotonic()
        self._drop_clients()
        return self._user is not None

    def baud(self) -> int | None:
        return None

    def unplug(self) -> None:
        for client in self._clients:
            client.gone = "gone"
        self._drop_clients()
        if self._server is not None:
            self._server.close()
            self._server = None

    def plug(self) -> None:
        if self._server is not None:
            return
        host, port = self._address
        try:
            family, resolved = resolve_host(host, port, socket.SOCK_STREAM)[0]
            self._server = socket.create_server(resolved, family=family, backlog=4)
        except (OSError, OverflowError, UnicodeError) as error:
            raise BadInput(f"tcp://{host}:{port}: {error}.", "Choose another port; 0 takes a free one.") from error
        self._server.setblocking(False)
        self._address = host, self._server.getsockname()[1]

    def close(self) -> None:
        self.unplug()

    def _read_from(self, client: TcpClient) -> bytes:
        """Return the commands of a client if the device is free for it; turn it away if not."""
        data, now_s = client.read(), time.monotonic()
        if client.gone and self._user is client:
            self._user = None
        if not data:
            return b""
        if self._user not in (None, client) and now_s < self._used_s + self._idle_s:
            client.gone = "gone"
            self._log(f"turned away {client.name}: another client has the device")
            return b""
        self._user, self._used_s = client, now_s
        return data

    def _accept_clients(self) -> None:
        while self._server is not None:
            try:
                connection, (host, port, *_) = self._server.accept()
            except (BlockingIOError, ConnectionError):
                return
            if len(self._clients) >= MAX_CLIENTS:
                connection.close()
                self._log(f"turned away {host}:{port}: there are {MAX_CLIENTS} clients")
                continue
            self._clients.append(TcpClient(connection, f"{host}:{port}"))
            self._log(f"client {host}:{port}")

    def _drop_clients(self) -> None:
        """Close the connections that have ended, and those of clients that do not read."""
        for client in self._clients.copy():
            if not client.gone and len(client.unsent) <= MAX_UNREAD_BYTES:
                continue
            self._clients.remove(client)
            self._user = None if self._user is client else self._user
            client.close()
            reason = "gone" if client.gone else f"dropped: it left {len(client.unsent)} bytes unread"
            self._log(f"client {client.name} {reason}")
