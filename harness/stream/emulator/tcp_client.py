"""A client at the emulator's TCP port: its commands come in whole, and its unread bytes wait in a bounded queue."""

import socket

from harness.stream.codec.commands import CommandReader

MAX_UNREAD_BYTES = 1 << 16
"""Bytes that wait here for a client, beyond those in the operating system's buffers: six seconds of a full line of
115200 baud [bytes]."""
_READ_BYTES = 4096
_SEND_BUFFER_BYTES = 1 << 16


class TcpClient:
    """One connection. It never blocks, and a command that the client has not finished disturbs no other client."""

    def __init__(self, connection: socket.socket, name: str) -> None:
        self.name = name
        self.open = True
        """False once the client has closed the connection or lost it."""
        self._connection, self._unsent = connection, b""
        self._commands = CommandReader()
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)

    def fileno(self) -> int:
        """Return the descriptor of the connection."""
        return self._connection.fileno()

    @property
    def unread_bytes(self) -> int:
        """Number of bytes that the client has left no room for."""
        return len(self._unsent)

    def read(self) -> bytes:
        """Return the commands that have become complete."""
        try:
            data = self._connection.recv(_READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        self.open &= bool(data)
        return b"".join(command.encode() for command in self._commands.feed(data))

    def write(self, data: bytes) -> None:
        """Send bytes, or keep them until the client reads."""
        self._unsent += data
        self.flush()

    def flush(self) -> None:
        """Send as many of the waiting bytes as the client takes."""
        try:
            while self._unsent:
                self._unsent = self._unsent[self._connection.send(self._unsent) :]
        except BlockingIOError:
            pass
        except OSError:
            self.open = False

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()
