"""A serial port as C programs use it: open, termios, read and write, without a library in between.

All ports are opened with O_NOCTTY, although some of the originals omit it: a test must not get a controlling terminal.
Nothing else differs.
"""

import array
import errno
import fcntl
import os
import select
import termios
import time
from collections.abc import Callable


def raw_mode(iflag: int = 0, vmin: int = 0, vtime: int = 0) -> Callable[[int], None]:
    """Return a function that configures a port for 115200 8N1: no line editing, no echo, no flow control."""

    def configure(fd: int) -> None:
        settings = termios.tcgetattr(fd)
        settings[0], settings[1], settings[3] = iflag, 0, 0
        control_flags = settings[2] & ~(termios.CSIZE | termios.CSTOPB | termios.PARENB)
        settings[2] = control_flags | termios.CS8 | termios.CREAD | termios.CLOCAL
        settings[4] = settings[5] = termios.B115200
        settings[6][termios.VMIN], settings[6][termios.VTIME] = vmin, vtime
        termios.tcsetattr(fd, termios.TCSANOW, settings)

    return configure


class Tty:
    """An open port. Methods raise OSError when the port cannot be opened or is gone."""

    def __init__(self, path: str, configure: Callable[[int], None], blocking: bool = False) -> None:
        self.sent, self.received = bytearray(), bytearray()
        """All bytes written, all bytes read."""
        self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY | (0 if blocking else os.O_NONBLOCK))
        try:
            configure(self._fd)
        except BaseException:
            self.close()
            raise

    def write(self, data: bytes) -> None:
        """Write all bytes; wait where the port takes no more."""
        self.sent += data
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                select.select([], [self._fd], [], 1.0)

    def read(self, max_bytes: int) -> bytes:
        """Read once; return the available bytes, at most `max_bytes`, or b""."""
        try:
            data = os.read(self._fd, max_bytes)
        except (BlockingIOError, InterruptedError):
            return b""
        self.received += data
        return data

    def read_available(self, max_bytes: int) -> bytes:
        """Read until nothing is available or `max_bytes` are read."""
        out = b""
        while len(out) < max_bytes and (data_read := self.read(max_bytes - len(out))):
            out += data_read
        return out

    def wait(self, limit_s: float) -> bool:
        """Whether there is something to read, after a wait of at most `limit_s`."""
        return bool(select.select([self._fd], [], [], max(limit_s, 0.0))[0])

    @property
    def waiting(self) -> int:
        """Number of bytes that could be read now."""
        count = array.array("i", [0])
        fcntl.ioctl(self._fd, termios.FIONREAD, count)
        return count[0]

    def drain(self) -> None:
        termios.tcdrain(self._fd)

    def flush_input(self) -> None:
        termios.tcflush(self._fd, termios.TCIFLUSH)

    def flush_both(self) -> None:
        termios.tcflush(self._fd, termios.TCIOFLUSH)

    def close(self) -> None:
        """Close the port for good; a port that is gone closes too."""
        if self._fd >= 0:
            try:
                os.close(self._fd)
            except OSError as error:
                if error.errno != errno.EIO:
                    raise
            self._fd = -1


def wait_until(condition: Callable[[], bool], limit_s: float, pause_s: float = 0.001) -> bool:
    """Poll a condition; return whether it became true before the limit."""
    end_s = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(pause_s)
    return True
