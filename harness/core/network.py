"""Host names to addresses: IPv4 first, since devices and receivers of UDP listen there."""

import socket
from typing import Any


def resolve_host(host: str, port: int, kind: socket.SocketKind) -> list[tuple[socket.AddressFamily, Any]]:
    """Family and address of a host for a socket of this kind, those of IPv4 first.

    `localhost` is ::1 before 127.0.0.1 on many systems, and a packet to ::1 reaches no receiver at 127.0.0.1. An IPv6
    literal keeps its family. Raises OSError or UnicodeError for an unknown host, never an empty list.
    """
    found = [(family, address) for family, _, _, _, address in socket.getaddrinfo(host, port, type=kind)]
    return sorted(found, key=lambda one: one[0] != socket.AF_INET)
