"""A client of the VRPN server: messages to it and from it."""

import socket
from collections.abc import Iterator
from typing import Any

from harness.stream.client_socket import ClientSocket
from harness.stream.vrpn.messages import COOKIE, MessageReader, NameTable, VrpnMessage


class ServedClient(ClientSocket):
    """A client, with the names that it described."""

    def __init__(self, connection: socket.socket, place: Any) -> None:
        super().__init__(connection, f"{place[0]}:{place[1]}")
        self.place = place
        """Address that it has, or asked to be connected to."""
        self.senders, self.types = NameTable(), NameTable()
        self.greeted = False
        """Whether names were described to it, so that it gets reports."""
        self.unsent += COOKIE
        self.reader, self._sequence = MessageReader(), 0

    def add(self, *messages: VrpnMessage) -> None:
        """Send messages as soon as the client takes them."""
        for message in messages:
            self.unsent += message.encode(self._sequence)
            self._sequence += 1

    def messages(self) -> Iterator[VrpnMessage]:
        """Yield what has arrived. Raises MalformedMessage."""
        yield from self.reader.feed(self.receive())
