"""Pseudo terminals with a fixed name, for programs that can only open serial ports. Not available on Windows.

At a `PtyPort` a client finds an emulator; at a `ClientPty` another program uses a device that is being recorded.
"""

import array
import contextlib
import fcntl
import os
import termios
import time
import tty
from pathlib import Path

from harness.errors import BadInput
from harness.stream.polhemus.emulator.config import SUPPORTED_BAUD_RATES

_READ_BYTES = 4096
_MAX_UNREAD_BYTES = 4000
"""Bytes that a client may leave unread before records are dropped; the terminal holds 4095."""
_FILLED_BYTES = 3800
"""Bytes to which `ClientPty` fills the terminal."""
MAX_WAITING_BYTES = 65536
"""Bytes that wait here for a program that reads too slowly, over five seconds of a full line."""
ABSENT_S = 1.0
"""Time without any reading after which waiting bytes are discarded, so that a program that opens the terminal later
does not receive old ones [s, choice]."""
_BAUD_BY_CONSTANT = {getattr(termios, f"B{rate}"): rate for rate in SUPPORTED_BAUD_RATES}


class _LinkedPty:
    """A pty in raw mode behind a symbolic link. Its own end stays open, so that a client may close and reopen it."""

    def __init__(self, link: Path | str, baud: int | None = None) -> None:
        """Create the pty, at this baud rate, and its link. Raises BadInput when the link's place is taken."""
        self._link = Path(link)
        self.master = self._slave = -1
        self._count = array.array("i", [0])
        self._open(baud)

    def read(self) -> bytes:
        """Return the bytes that the client has written; b"" without any."""
        try:
            return os.read(self.master, _READ_BYTES) if self.master >= 0 else b""
        except BlockingIOError:
            return b""

    def baud(self) -> int | None:
        """Baud rate that the client has set [bit/s]; None for one that no IS-900 has."""
        return _BAUD_BY_CONSTANT.get(termios.tcgetattr(self._slave)[5]) if self._slave >= 0 else None

    def close(self) -> None:
        """Remove the link, if it still leads here, and close the pty, as when an adapter is pulled out."""
        if self.master >= 0:
            with contextlib.suppress(OSError):
                if os.readlink(self._link) == os.ttyname(self._slave):
                    self._link.unlink()
            self._release()

    def _open(self, baud: int | None = None) -> None:
        check_link_is_free(self._link)
        self.master, self._slave = os.openpty()
        try:
            tty.setraw(self._slave)
            if baud is not None:
                attributes = termios.tcgetattr(self._slave)
                attributes[4] = attributes[5] = getattr(termios, f"B{baud}")
                termios.tcsetattr(self._slave, termios.TCSANOW, attributes)
            os.set_blocking(self.master, False)
            if self._link.is_symlink():  # of a program that was killed
                self._link.unlink()
            self._link.symlink_to(os.ttyname(self._slave))
        except OSError as error:
            self._release()
            advice = "Name a link in a folder that you can write to."
            raise BadInput(f"{self._link}: {error.strerror}.", advice) from error

    def _release(self) -> None:
        ends, self.master, self._slave = (self._slave, self.master), -1, -1
        for end in ends:
            os.close(end)

    def _unread_bytes(self) -> int:
        """Return the number of bytes that the client has not read."""
        fcntl.ioctl(self._slave, termios.FIONREAD, self._count)
        return self._count[0]


class PtyPort(_LinkedPty):
    """The port of an emulator at a pty: messages are written whole or not at all."""

    _unsent = b""

    @property
    def name(self) -> str:
        return str(self._link)

    def readable(self) -> list[int]:
        return [] if self.master < 0 else [self.master]

    def writable(self) -> list[int]:
        return [self.master] if self._unsent and self.master >= 0 else []

    def read(self) -> bytes:
        self._flush()
        return super().read()

    def write(self, data: bytes) -> bool:
        self._flush()
        if self.master < 0 or self._unsent or self._unread_bytes() + len(data) > _MAX_UNREAD_BYTES:
            return False
        self._unsent = data
        self._flush()
        if len(self._unsent) < len(data):
            return True
        self._unsent = b""
        return False

    def plug(self) -> None:
        if self.master < 0:
            self._open()

    def unplug(self) -> None:
        self.close()
        self._unsent = b""

    def _flush(self) -> None:
        if self._unsent and self.master >= 0:
            with contextlib.suppress(BlockingIOError):
                self._unsent = self._unsent[os.write(self.master, self._unsent) :]


class ClientPty(_LinkedPty):
    """The pty at which a program uses a recorded device: bytes that do not fit wait for it."""

    def __init__(self, link: Path | str, baud: int | None) -> None:
        super().__init__(link, baud)
        self.unread = 0
        """Bytes that the program did not read in time, and that were discarded."""
        self._waiting = bytearray()
        self._left, self._read_s = 0, time.monotonic()

    def write(self, data: bytes) -> None:
        """Pass bytes on. Those that do not fit wait; beyond `MAX_WAITING_BYTES` they are discarded and counted."""
        fitting = data[: MAX_WAITING_BYTES - len(self._waiting)]
        self.unread += len(data) - len(fitting)
        self._waiting += fitting
        self.flush()

    def flush(self) -> bool:
        """Pass on waiting bytes as far as there is room. Returns whether bytes still wait."""
        now_s, left = time.monotonic(), self._unread_bytes()
        if left < self._left or left == 0:
            self._read_s = now_s
        elif now_s - self._read_s > ABSENT_S:
            termios.tcflush(self._slave, termios.TCIFLUSH)
            self.unread += left + len(self._waiting)
            self._waiting.clear()
            left, self._read_s = 0, now_s
        if self._waiting and left < _FILLED_BYTES:
            with contextlib.suppress(BlockingIOError):
                written = os.write(self.master, self._waiting[: _FILLED_BYTES - left])
                del self._waiting[:written]
                left += written
        self._left = left
        return bool(self._waiting)


def check_link_is_free(link: Path) -> None:
    """Raise BadInput unless the place is free, or holds a link to a pty that no longer exists."""
    if link.is_symlink():
        target = os.readlink(link)
        if not target.startswith("/dev/pts/") or os.path.exists(target):
            raise BadInput(f"{link} exists and leads to {target}.", "Name another link, or remove it.")
    elif link.exists():
        raise BadInput(f"{link} exists and is no link of an emulator.", "Name another link; nothing is overwritten.")
