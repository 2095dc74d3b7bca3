"""The pseudo terminal at which another program uses a device that is being recorded. Not available on Windows."""

import array
import contextlib
import fcntl
import os
import termios
import time
import tty
from pathlib import Path

from harness.errors import BadInput
from harness.stream.emulator.pty_port import BAUD_BY_CONSTANT, check_link_is_free

READ_BYTES = 4096
_TERMINAL_BYTES = 3800
"""Bytes that are left in the terminal, which holds 4095."""
MAX_WAITING_BYTES = 65536
"""Bytes that wait here for a program that reads too slowly, over five seconds of a full line."""
ABSENT_S = 1.0
"""Time without any reading after which waiting bytes are discarded, so that a program that opens the terminal later
does not receive old ones [s, choice]."""


class ClientPty:
    """A pty in raw mode behind a symbolic link. Its other end stays open, so that a program may close and reopen it."""

    def __init__(self, link: Path | str, baud: int | None) -> None:
        """Create the pty, at this baud rate, and its link. Raises BadInput when the link's place is taken."""
        self.link = Path(link)
        self.unread = 0
        """Bytes that the program did not read in time, and that were discarded."""
        self._waiting = bytearray()
        self._count, self._left, self._read_s = array.array("i", [0]), 0, time.monotonic()
        check_link_is_free(self.link)
        self.master, self._slave = os.openpty()
        try:
            tty.setraw(self._slave)
            self._set_baud(baud)
            os.set_blocking(self.master, False)
            if self.link.is_symlink():  # of a program that was killed
                self.link.unlink()
            self.link.symlink_to(os.ttyname(self._slave))
        except OSError as error:
            self._release()
            advice = "Name a link in a folder that you can write to."
            raise BadInput(f"{self.link}: {error.strerror}.", advice) from error

    def baud(self) -> int | None:
        """Baud rate that the program has set [bit/s]; None for one that no IS-900 has."""
        return BAUD_BY_CONSTANT.get(termios.tcgetattr(self._slave)[5])

    def read(self) -> bytes:
        """Return the bytes that the program has written; b"" without any."""
        try:
            return os.read(self.master, READ_BYTES)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Pass bytes on. Those that do not fit wait; beyond `MAX_WAITING_BYTES` they are discarded and counted."""
        fitting = data[: MAX_WAITING_BYTES - len(self._waiting)]
        self.unread += len(data) - len(fitting)
        self._waiting += fitting
        self.flush()

    def flush(self) -> bool:
        """Pass on waiting bytes as far as there is room. Returns whether bytes still wait."""
        now_s = time.monotonic()
        fcntl.ioctl(self._slave, termios.FIONREAD, self._count)
        left = self._count[0]
        if left < self._left or left == 0:
            self._read_s = now_s
        elif now_s - self._read_s > ABSENT_S:
            termios.tcflush(self._slave, termios.TCIFLUSH)
            self.unread += left + len(self._waiting)
            self._waiting.clear()
            left, self._read_s = 0, now_s
        if self._waiting and left < _TERMINAL_BYTES:
            with contextlib.suppress(BlockingIOError):
                written = os.write(self.master, self._waiting[: _TERMINAL_BYTES - left])
                del self._waiting[:written]
                left += written
        self._left = left
        return bool(self._waiting)

    def close(self) -> None:
        """Remove the link, if it still leads here, and close the pty."""
        with contextlib.suppress(OSError):
            if os.readlink(self.link) == os.ttyname(self._slave):
                self.link.unlink()
        self._release()

    def _set_baud(self, baud: int | None) -> None:
        if baud is not None:
            attributes = termios.tcgetattr(self._slave)
            attributes[4] = attributes[5] = getattr(termios, f"B{baud}")
            termios.tcsetattr(self._slave, termios.TCSANOW, attributes)

    def _release(self) -> None:
        os.close(self.master)
        os.close(self._slave)
