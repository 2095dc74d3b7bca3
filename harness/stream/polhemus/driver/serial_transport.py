"""A serial port, by pyserial: a native port or a pty."""

import errno
import os
import sys
import time

import serial
from serial.tools import list_ports

from harness.errors import BadInput
from harness.stream.polhemus.codec.items import BAUD_RATES
from harness.stream.polhemus.driver.transport import (
    IO_ERRORS,
    READ_BYTES,
    WRITE_TIMEOUT_S,
    BaseTransport,
    LineLost,
    SelectTransport,
    Transport,
)

_BUSY_ERRNOS = (errno.EBUSY, errno.EAGAIN)
_BAUD_RATES_TEXT = f"{', '.join(map(str, BAUD_RATES[:-1]))} and {BAUD_RATES[-1]}"
_POLL_INTERVAL_S = 0.002
"""Interval between two reads of a port that cannot be waited for [s]."""


def open_serial(port: str, baud: int) -> Transport:
    """Open a port for this process alone: 8N1, no handshake (docs/is900.md 2). Raises BadInput."""
    try:
        opened = serial.Serial(port, baud, timeout=0, write_timeout=WRITE_TIMEOUT_S, exclusive=True)
    except IO_ERRORS as error:
        raise serial_port_error(port, baud, error) from error
    return PolledSerialTransport(port, opened) if sys.platform == "win32" else SelectSerialTransport(port, opened)


def serial_port_error(port: str, baud: int, error: Exception) -> BadInput:
    """Return the error for a serial port that could not be opened."""
    number = getattr(error, "errno", None)
    if isinstance(error, ValueError):
        return BadInput(f"Port {port} at {baud} baud: {error}.", f"The device uses {_BAUD_RATES_TEXT}.")
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
    if os.path.isfile(port):
        return BadInput(f"Port {port}: a file, not a port.", "Name the port of the device, such as /dev/ttyUSB0.")
    reason = getattr(error, "strerror", None) or error
    return BadInput(f"Port {port} cannot be used as a serial port: {reason}.", "Name the port of the device.")


def _owner_group(port: str) -> str:
    """Return the group that owns a port file, or a guess where that cannot be determined."""
    try:
        import grp

        return grp.getgrgid(os.stat(port).st_gid).gr_name
    except (ImportError, KeyError, OSError):
        return "often dialout"


class SelectSerialTransport(SelectTransport):
    """A serial port that the operating system can wait for."""

    def __init__(self, name: str, port: serial.Serial) -> None:
        super().__init__(name, port.fileno())
        self._port = port

    def set_baud(self, baud: int) -> None:
        try:
            self._port.baudrate = baud
        except IO_ERRORS as error:
            raise LineLost(self.name, self.reason(error)) from error

    def _take(self) -> bytes:
        return bytes(self._port.read(READ_BYTES))

    def _check_alive(self) -> None:
        if os.stat(self.name).st_rdev != os.fstat(self.descriptor).st_rdev:
            raise OSError("the name belongs to another port now")

    def _send(self, data: bytes) -> None:
        self._port.write(data)

    def _release(self) -> None:
        self._port.close()
        super()._release()


class PolledSerialTransport(BaseTransport):
    """A serial port on Windows, polled every 2 ms."""

    def __init__(self, name: str, port: serial.Serial) -> None:
        super().__init__(name)
        self._port = port

    def _receive(self, timeout_s: float) -> bytes:
        until_s = time.monotonic() + timeout_s
        while True:
            data = bytes(self._port.read(READ_BYTES))
            if data or time.monotonic() >= until_s or self._closed.wait(_POLL_INTERVAL_S):
                return data

    def _send(self, data: bytes) -> None:
        self._port.write(data)

    def _release(self) -> None:
        self._port.close()
