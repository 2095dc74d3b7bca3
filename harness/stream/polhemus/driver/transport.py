"""What every line to a device is: bytes without interpretation, one reader at a time, and a close that it notices.

A read takes what is available, after a wait in `select` wherever the operating system can wait for a port, which is
everywhere but on Windows.
"""

import contextlib
import select
import socket
import sys
import threading
from abc import ABC, abstractmethod
from typing import Protocol

import serial

from harness.errors import HarnessError

if sys.platform == "win32":
    IO_ERRORS: tuple[type[Exception], ...] = (OSError, ValueError)
else:
    import termios

    IO_ERRORS = (OSError, ValueError, termios.error)
READ_BYTES = 65536
"""More than any operating system buffers for a port [bytes]."""
WRITE_TIMEOUT_S = 2.0
"""A line that takes no byte for so long is lost [s]."""


def describe_io_error(error: Exception) -> str:
    """Return why a line cannot be used any more; texts of libraries and numbers of errors are left out."""
    if isinstance(error, serial.SerialTimeoutException):
        return f"the line takes no byte for {WRITE_TIMEOUT_S:g} s"
    if isinstance(error, serial.SerialException):
        return "the line is gone (unplugged, or closed by its other end)"
    return f"the line is gone ({getattr(error, 'strerror', None) or error.args[-1] if error.args else error})"


class LineLost(HarnessError):
    """The line is gone: unplugged, closed by the other side, or closed by this program."""

    def __init__(self, port: str, why: str) -> None:
        super().__init__(port, why)
        self.port, self.why = self.args

    def __str__(self) -> str:
        return f"{self.port}: {self.why}."


class Transport(Protocol):
    """Interface of an open line. One thread reads; another may write or close meanwhile."""

    @property
    def name(self) -> str:
        """The port as the user named it."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Return the available bytes, after a wait of at most `timeout_s` for the first one; b"" when none arrives.

        Raises LineLost when nothing can arrive any more.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all bytes. Raises LineLost when the line does not take them."""
        ...

    def close(self) -> None:
        """Close the line. May be called twice, and while another thread reads: its read raises LineLost."""
        ...


class BaseTransport(ABC):
    """Shared part of all transports: one reader at a time, and a close that the reader notices."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._reading = threading.RLock()
        self._closed = threading.Event()

    def read(self, timeout_s: float) -> bytes:
        with self._reading:
            try:
                data = b"" if self._closed.is_set() else self._receive(timeout_s)
            except IO_ERRORS as error:
                raise LineLost(self.name, self.reason(error)) from error
            if self._closed.is_set():
                raise LineLost(self.name, "closed")
            return data

    def write(self, data: bytes) -> None:
        try:
            self._send(data)
        except IO_ERRORS as error:
            raise LineLost(self.name, self.reason(error)) from error

    def close(self) -> None:
        self._closed.set()
        self._wake()
        with self._reading:
            self._release()

    def reason(self, error: Exception) -> str:
        """Return why the line is lost, by the error of its last use."""
        return "closed" if self._closed.is_set() else describe_io_error(error)

    @abstractmethod
    def _receive(self, timeout_s: float) -> bytes:
        """Return the bytes that are available after a wait of at most `timeout_s` [s]."""

    @abstractmethod
    def _send(self, data: bytes) -> None: ...

    def _wake(self) -> None:  # noqa: B027  # the default does nothing: short waits need no waking
        """End the wait of another thread."""

    @abstractmethod
    def _release(self) -> None: ...


class SelectTransport(BaseTransport):
    """A transport whose file descriptor can be waited for."""

    def __init__(self, name: str, descriptor: int) -> None:
        super().__init__(name)
        self.descriptor = descriptor
        """What `select` and `poll` wait for."""
        self._woken, self._waker = socket.socketpair()

    def _receive(self, timeout_s: float) -> bytes:
        ready, _, _ = select.select([self.descriptor, self._woken.fileno()], [], [], max(timeout_s, 0.0))
        if self.descriptor in ready:
            return self._take()
        self._check_alive()
        return b""

    def set_baud(self, baud: int) -> None:
        """Set the baud rate of an open serial port [bit/s]; without effect on other lines. Raises LineLost."""

    @abstractmethod
    def _take(self) -> bytes:
        """Return the available bytes, of which there is at least one."""

    def _check_alive(self) -> None:  # a socket reports a lost peer by itself
        """Called when nothing arrived; raises OSError when nothing can arrive any more."""

    def _wake(self) -> None:
        with contextlib.suppress(OSError):  # closed already
            self._waker.send(b"x")

    def _release(self) -> None:
        self._woken.close()
        self._waker.close()
