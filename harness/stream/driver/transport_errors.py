"""Errors of opening a line: which port, why, and what to try."""

import errno
import os
import socket
from urllib.parse import urlsplit

from serial.tools import list_ports

from harness.errors import BadInput
from harness.stream.codec.items import BAUD_RATES

_BUSY_ERRNOS = (errno.EBUSY, errno.EAGAIN)
_TCP_EXAMPLE = "tcp://HOST:PORT, such as tcp://127.0.0.1:5005"
_BAUD_RATES_TEXT = f"{', '.join(map(str, BAUD_RATES[:-1]))} and {BAUD_RATES[-1]}"


def unknown_scheme_error(port: str) -> BadInput:
    """Return the error for `spy://...` and other unsupported addresses."""
    return BadInput(
        f"Port {port}: this kind of address is not known.",
        "Name a serial port (/dev/ttyUSB0, COM3), tcp://HOST:PORT, socket://HOST:PORT or udp://HOST:PORT.",
    )


def parse_network_address(port: str) -> tuple[str, int]:
    """Split `tcp://host:port` or `udp://host:port` into host and port number. Raises BadInput when one is missing."""
    example = "udp://HOST:PORT, such as udp://127.0.0.1:5001" if port.startswith("udp:") else _TCP_EXAMPLE
    try:
        parts = urlsplit(port)
        host, number = parts.hostname, parts.port
    except ValueError as error:
        raise BadInput(f"Port {port}: {error}.", f"Write {example}.") from error
    if not host or not number:
        raise BadInput(f"Port {port}: host or port number is missing.", f"Write {example}.")
    return host, number


def tcp_connection_error(port: str, address: tuple[str, int], error: Exception) -> BadInput:
    """Return the error for a host that could not be reached."""
    host, number = address
    if isinstance(error, (socket.gaierror, UnicodeError)):
        return BadInput(f"Port {port}: there is no host called {host}.", "Check the name, or give its address.")
    if isinstance(error, TimeoutError):
        return BadInput(f"Port {port}: {host} does not answer.", "Check the address, the cable and any firewall.")
    if isinstance(error, ConnectionRefusedError):
        return BadInput(
            f"Port {port}: nothing listens at {host}, port {number}.",
            "Start the device (or `harness emulate`) first, and check the port number.",
        )
    return BadInput(f"Port {port}: {_error_text(error)}.", "Check the address and the network.")


def udp_port_error(port: str, address: tuple[str, int], error: Exception) -> BadInput:
    """Return the error for an address at which packets cannot be received."""
    host, number = address
    if isinstance(error, (socket.gaierror, UnicodeError)):
        return BadInput(f"Port {port}: there is no host called {host}.", "Check the name, or give its address.")
    if getattr(error, "errno", None) == errno.EADDRINUSE:
        return BadInput(
            f"Port {port}: another program receives at port {number}.", "Close that program, or choose another port."
        )
    return BadInput(
        f"Port {port}: {_error_text(error)}.",
        "Name an address of this computer: 127.0.0.1, or 0.0.0.0 for packets from the network.",
    )


def serial_port_error(port: str, baud: int, error: Exception) -> BadInput:
    """Return the error for a serial port that could not be opened."""
    number = getattr(error, "errno", None)
    if isinstance(error, ValueError):
        return BadInput(f"Port {port} at {baud} baud: {error}.", f"An IS-900 uses {_BAUD_RATES_TEXT}.")
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV) or isinstance(error, FileNotFoundError):
        ports = ", ".join(sorted(known.device for known in list_ports.comports())) or "none"
        return BadInput(f"Port {port}: there is no such port.", f"Serial ports of this computer: {ports}.")
    if number == errno.EACCES and os.name == "posix":
        return BadInput(
            f"Port {port}: permission denied.",
            f"Join the group that may open it ({_owner_group(port)}), then log in again.",
        )
    if number in (*_BUSY_ERRNOS, errno.EACCES):
        return BadInput(f"Port {port}: another program has it open.", "Close that program; only one may use the port.")
    return BadInput(
        f"Port {port} cannot be used as a serial port: {_error_text(error)}.", "Name the port of the device."
    )


def _error_text(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def _owner_group(port: str) -> str:
    """Return the group that owns a port file, or a guess where that cannot be determined."""
    try:
        import grp

        return grp.getgrgid(os.stat(port).st_gid).gr_name
    except (ImportError, KeyError, OSError):
        return "often dialout"
