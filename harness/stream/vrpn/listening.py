"""Where the VRPN server listens: the name and address that a user writes, and the sockets there."""

import contextlib
import errno
import socket

from harness.core.network import LOOPBACK, describe_network_error, parse_address, resolve_host
from harness.errors import BadInput, shorten
from harness.stream.client_socket import MAX_CLIENTS
from harness.stream.vrpn.messages import DEFAULT_PORT, MAX_NAME_BYTES

_TRIES = 16
"""Free TCP ports that are tried until the UDP port of the same number is free too."""


def parse_served_name(text: str) -> tuple[str, str, int]:
    """Name, host and port of `NAME[@[HOST:]PORT]`; this computer and VRPN's port by default. Raises BadInput."""
    name, at, place = text.partition("@")
    host, port = parse_address(place, LOOPBACK) if at else (LOOPBACK, DEFAULT_PORT)
    if not name or not name.isprintable() or len(name.encode()) >= MAX_NAME_BYTES // 2:
        raise BadInput(f"--vrpn {shorten(text)}: no name of a tracker.", "Write NAME[@HOST:PORT], such as Tracker0.")
    return name, host, port


def open_listeners(host: str, port: int) -> tuple[socket.socket, socket.socket]:
    """Sockets that listen for TCP and UDP at one port. Raises BadInput."""
    for _ in range(0 if port else _TRIES):
        with contextlib.suppress(OSError):
            return _bind(host, 0)
    try:
        return _bind(host, port)
    except (OSError, UnicodeError) as error:
        raise _bind_error(host, port, error) from error


def _bind(host: str, port: int) -> tuple[socket.socket, socket.socket]:
    family, place = resolve_host(host, port, socket.SOCK_STREAM)[0]
    with contextlib.ExitStack() as opened:
        tcp = opened.enter_context(socket.socket(family, socket.SOCK_STREAM))
        tcp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        tcp.bind(place)
        udp = opened.enter_context(socket.socket(family, socket.SOCK_DGRAM))
        udp.bind((place[0], tcp.getsockname()[1], *place[2:]))
        tcp.listen(MAX_CLIENTS)
        tcp.setblocking(False)
        udp.setblocking(False)
        opened.pop_all()
    return tcp, udp


def _bind_error(host: str, port: int, error: Exception) -> BadInput:
    if getattr(error, "errno", None) == errno.EADDRINUSE:
        advice = "Close that program, or name another port: --vrpn NAME@127.0.0.1:3884."
        return BadInput(f"VRPN at {host}:{port}: another program listens there.", advice)
    reason = describe_network_error(error, host, port)
    return BadInput(f"VRPN at {host}:{port}: {reason}.", "Name an address of this computer, such as 127.0.0.1:3883.")
