"""A connection to a client of a server, which never blocks."""

import socket

MAX_CLIENTS = 32
"""A server turns further clients away."""
_READ_BYTES = 1 << 16


class ClientSocket:
    """One connection. What the client leaves no room for waits here."""

    def __init__(self, connection: socket.socket, name: str) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.name = name
        self.gone = ""
        """Why the client is disconnected; "" while it is not."""
        self.unsent = bytearray()
        self._socket = connection

    def fileno(self) -> int:
        """Return the descriptor of the connection."""
        return self._socket.fileno()

    def receive(self) -> bytes:
        """Return what has arrived; b"" for nothing, and where the client is gone."""
        try:
            data = self._socket.recv(_READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError as error:
            self.gone = str(error.strerror or error)
            return b""
        if not data:
            self.gone = "it has closed the connection"
        return data

    def flush(self) -> None:
        """Send as many of the waiting bytes as the client takes."""
        try:
            while self.unsent:
                del self.unsent[: self._socket.send(self.unsent)]
        except BlockingIOError:
            pass
        except OSError as error:
            self.gone = self.gone or str(error.strerror or error)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()
