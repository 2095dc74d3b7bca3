"""A TCP port of the emulator: it carries the same bytes as the serial line (docs/is900.md 9)."""

import socket
from collections.abc import Callable

from harness.errors import BadInput

LogCallback = Callable[[str], None]
"""Receives one line of text for the user."""
_READ_BYTES = 4096
_LOOPBACK = ("127.0.0.1", "::1", "localhost")


class TcpPort:
    """A TCP port for one client at a time; further clients are turned away at once."""

    def __init__(self, host: str, port: int, *, anywhere: bool = False, log: LogCallback = lambda line: None) -> None:
        """Listen at this address. Raises BadInput when it is taken, or reachable by others without `anywhere`."""
        if host not in _LOOPBACK and not anywhere:
            advice = "Use 127.0.0.1, or --anywhere: anyone who reaches the port can then command the emulator."
            raise BadInput(f"{host} is reachable from other computers.", advice)
        self._log = log
        self._client: socket.socket | None = None
        self._unsent = b""
        self._server: socket.socket | None = None
        self._address = host, port
        self.plug()

    @property
    def name(self) -> str:
        host, port = self._address
        return f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"

    def readable(self) -> list[int]:
        return [end.fileno() for end in (self._server, self._client) if end is not None]

    def writable(self) -> list[int]:
        return [self._client.fileno()] if self._unsent and self._client is not None else []

    def read(self) -> bytes:
        self._flush()
        data = self._receive()
        if not data:  # notice a departed client before accepting one: the same client may be reconnecting
            self._accept_client()
        return data

    def _receive(self) -> bytes:
        if self._client is None:
            return b""
        try:
            data = self._client.recv(_READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop_client()
        return data

    def write(self, data: bytes) -> bool:
        self._flush()
        if self._client is None or self._unsent:
            return False
        self._unsent = data
        self._flush()
        if self._client is not None and len(self._unsent) < len(data):
            return True
        self._unsent = b""
        return False

    def baud(self) -> int | None:
        return None

    def unplug(self) -> None:
        self._drop_client()
        if self._server is not None:
            self._server.close()
            self._server = None

    def plug(self) -> None:
        if self._server is not None:
            return
        host, port = self._address
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            self._server = socket.create_server(self._address, family=family, backlog=4)
        except (OSError, OverflowError) as error:
            raise BadInput(f"tcp://{host}:{port}: {error}.", "Choose another port; 0 takes a free one.") from error
        self._server.setblocking(False)
        self._address = host, self._server.getsockname()[1]

    def close(self) -> None:
        self.unplug()

    def _accept_client(self) -> None:
        """Accept a waiting client if there is none; turn away further ones."""
        while self._server is not None:
            try:
                client, address = self._server.accept()
            except (BlockingIOError, ConnectionError):
                return
            if self._client is not None:
                client.close()
                self._log(f"turned away {address[0]}:{address[1]}: one client at a time")
                continue
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 16)
            self._client = client
            self._log(f"client {address[0]}:{address[1]}")

    def _drop_client(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client, self._unsent = None, b""
            self._log("client gone")

    def _flush(self) -> None:
        if self._unsent and self._client is not None:
            try:
                self._unsent = self._unsent[self._client.send(self._unsent) :]
            except BlockingIOError:
                pass
            except OSError:
                self._drop_client()
