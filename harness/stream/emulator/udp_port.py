"""The socket from which the emulator broadcasts: to this computer, unless the user asks for more."""

import ipaddress
import socket

from harness.core.network import resolve_host
from harness.errors import BadInput
from harness.stream.emulator.addresses import check_loopback, parse_address

LOOPBACK = "127.0.0.1"


def parse_udp_address(text: str, anywhere: bool) -> tuple[str, int]:
    """Parse `[HOST:]PORT`, by default on this computer. Raises BadInput for another one without `anywhere`."""
    host, port = parse_address(text, LOOPBACK)
    check_loopback(host, anywhere, "everyone on that network then receives the motion")
    return host, port


class UdpPort:
    """Sends packets to one host or broadcast address. It never blocks."""

    def __init__(self, host: str = LOOPBACK) -> None:
        """Open the socket; BadInput for an unknown host."""
        try:
            family, (self.host, _, *self._scope) = resolve_host(host, 0, socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as error:
            raise BadInput(f"No host is called {host} ({error}).", "Give [HOST:]PORT.") from error
        self.sent = self.unsent = 0
        """Numbers of packets that were sent, and of those that the operating system did not take."""
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        if not ipaddress.ip_address(self.host).is_loopback:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, packet: bytes, port: int) -> None:
        """Send a packet; a receiver that is absent or slow does not show."""
        try:
            self._socket.sendto(packet, (self.host, port, *self._scope))
            self.sent += 1
        except OSError:
            self.unsent += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
