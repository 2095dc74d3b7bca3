"""A serial port as programs written in C use it: open, termios, read and write, without any library between.

Ports are opened with O_NOCTTY throughout, although some of the originals leave it out: a test must not get a
controlling terminal. Nothing else differs.
"""

import array
import errno
import fcntl
import os
import select
import termios
import time
from collections.abc import Callable


def raw(iflag: int = 0, vmin: int = 0, vtime: int = 0) -> Callable[[int], None]:
    """Settings of a port at 115200 8N1: no line editing, no echo, no flow control."""

    def set_up(fd: int) -> None:
        settings = termios.tcgetattr(fd)
        settings[0], settings[1], settings[3] = iflag, 0, 0
        kept = settings[2] & ~(termios.CSIZE | termios.CSTOPB | termios.PARENB)
        settings[2] = kept | termios.CS8 | termios.CREAD | termios.CLOCAL
        settings[4] = settings[5] = termios.B115200
        settings[6][termios.VMIN], settings[6][termios.VTIME] = vmin, vtime
        termios.tcsetattr(fd, termios.TCSANOW, settings)

    return set_up


class Tty:
    """An open port; OSError when it cannot be had or has gone."""

    def __init__(self, path: str, set_up: Callable[[int], None], blocking: bool = False) -> None:
        self.sent, self.received = bytearray(), bytearray()
        """All that went out, all that was read."""
        self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY | (0 if blocking else os.O_NONBLOCK))
        try:
            set_up(self._fd)
        except BaseException:
            self.close()
            raise

    def write(self, data: bytes) -> None:
        """All of it; waits where the port takes no more."""
        self.sent += data
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                select.select([], [self._fd], [], 1.0)

    def read(self, most: int) -> bytes:
        """One read: what is there, at most so much; b"" when nothing is."""
        try:
            data = os.read(self._fd, most)
        except (BlockingIOError, InterruptedError):
            return b""
        self.received += data
        return data

    def read_available(self, most: int) -> bytes:
        """Reads until nothing is there or so much is read."""
        out = b""
        while len(out) < most and (more := self.read(most - len(out))):
            out += more
        return out

    def wait(self, limit_s: float) -> bool:
        """Whether there is something to read, at the latest after so long."""
        return bool(select.select([self._fd], [], [], max(limit_s, 0.0))[0])

    @property
    def waiting(self) -> int:
        """Bytes that could be read now."""
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
        """Once and for all; a port that is gone closes too."""
        if self._fd >= 0:
            try:
                os.close(self._fd)
            except OSError as error:
                if error.errno != errno.EIO:
                    raise
            self._fd = -1


def wait_until(condition: Callable[[], bool], limit_s: float, pause_s: float = 0.001) -> bool:
    """Whether it came true before the limit; looks again and again."""
    end_s = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(pause_s)
    return True
