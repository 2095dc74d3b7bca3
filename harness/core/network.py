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
