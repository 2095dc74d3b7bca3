"""The socket from which the emulator broadcasts: to this computer, unless the user asks for more."""

import ipaddress
import socket

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
        self.host = host
        self.sent = self.unsent = 0
        """Numbers of packets that were sent, and of those that the operating system did not take."""
        self._socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        if not _is_loopback(host):
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, packet: bytes, port: int) -> None:
        """Send a packet; a receiver that is absent or slow does not show."""
        try:
            self._socket.sendto(packet, (self.host, port))
            self.sent += 1
        except OSError:
            self.unsent += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
