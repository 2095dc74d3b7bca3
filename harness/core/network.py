"""Addresses of hosts: IPv4 first, since devices and receivers of UDP listen there; loopback unless asked."""

import socket
from typing import Any

from harness.errors import BadInput

LOOPBACK = "127.0.0.1"
VRPN_PREFIX, FASTRAK_PREFIX = "vrpn:", "fastrak:"
"""Beginnings of ports: a tracker of a VRPN server, and a line at which a FASTRAK is."""
_LOOPBACK = ("127.0.0.1", "::1", "localhost")


def resolve_host(host: str, port: int, kind: socket.SocketKind) -> list[tuple[socket.AddressFamily, Any]]:
    """Family and address of a host for a socket of this kind, those of IPv4 first.

    `localhost` is ::1 before 127.0.0.1 on many systems, and a packet to ::1 reaches no receiver at 127.0.0.1. An IPv6
    literal keeps its family. Raises OSError or UnicodeError for an unknown host, never an empty list.
    """
    found = [(family, address) for family, _, _, _, address in socket.getaddrinfo(host, port, type=kind)]
    return sorted(found, key=lambda one: one[0] != socket.AF_INET)


def connect_tcp(host: str, port: int, timeout_s: float) -> socket.socket:
    """A connection to the first address of a host that answers within `timeout_s` [s]; small packets go at once.

    Raises OSError of the first address if none answers, and UnicodeError for a name that no host can have.
    """
    errors = []
    for family, resolved in resolve_host(host, port, socket.SOCK_STREAM):
        opened = socket.socket(family, socket.SOCK_STREAM)
        opened.settimeout(timeout_s)
        try:
            opened.connect(resolved)
        except OSError as error:
            opened.close()
            errors.append(error)
        else:
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return opened
    raise errors[0]


def describe_network_error(error: Exception, host: str, port: int) -> str:
    """Why a host could not be reached, or an address not be used, without numbers of errors."""
    if isinstance(error, (socket.gaierror, UnicodeError)):
        return f"there is no host called {host}"
    if isinstance(error, TimeoutError):
        return f"{host} does not answer"
    if isinstance(error, ConnectionRefusedError):
        return f"nothing listens at {host}, port {port}"
    return str(getattr(error, "strerror", None) or error)


def parse_address(text: str, default_host: str = "") -> tuple[str, int]:
    """Split `HOST:PORT`, or `PORT` where there is a default host. Raises BadInput."""
    host, _, number = text.rpartition(":")
    host = host or default_host
    if not host or not (number.isascii() and number.isdecimal() and len(number) <= 5) or int(number) > 65535:
        raise BadInput(f"{text!r} is no HOST:PORT.", "An example is 127.0.0.1:5005.")
    return host.strip("[]"), int(number)


def check_loopback(host: str, anywhere: bool, risk: str) -> None:
    """Raise BadInput for an address outside this computer, unless `anywhere`. `risk` says what others could do."""
    if host not in _LOOPBACK and not anywhere:
        raise BadInput(f"{host} is reachable from other computers.", f"Use 127.0.0.1, or --anywhere: {risk}.")
