"""A pseudo terminal with a fixed name, for clients that can only open serial ports. Not available on Windows."""

import array
import contextlib
import fcntl
import os
import termios
import tty
from pathlib import Path

from harness.errors import BadInput
from harness.stream.emulator.config import SUPPORTED_BAUD_RATES

_READ_BYTES = 4096
_MAX_UNREAD_BYTES = 4000
"""Bytes that a client may leave unread before records are dropped; the terminal holds 4095."""


BAUD_BY_CONSTANT = {getattr(termios, f"B{rate}"): rate for rate in SUPPORTED_BAUD_RATES}


class PtyPort:
    """A pty in raw mode behind a symbolic link. Its own end stays open, so that a client may close and reopen it."""

    def __init__(self, link: Path | str) -> None:
        """Create the pty and its link. Raises BadInput when the link's place is taken."""
        self._link = Path(link)
        self._unsent = b""
        self._master = self._slave = -1
        self.plug()

    @property
    def name(self) -> str:
        return str(self._link)

    def readable(self) -> list[int]:
        return [] if self._master < 0 else [self._master]

    def writable(self) -> list[int]:
        return [self._master] if self._unsent and self._master >= 0 else []

    def read(self) -> bytes:
        self._flush()
        try:
            return os.read(self._master, _READ_BYTES) if self._master >= 0 else b""
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> bool:
        self._flush()
        if self._master < 0 or self._unsent or self._unread_bytes() + len(data) > _MAX_UNREAD_BYTES:
            return False
        self._unsent = data
        self._flush()
        if len(self._unsent) < len(data):
            return True
        self._unsent = b""
        return False

    def baud(self) -> int | None:
        return BAUD_BY_CONSTANT.get(termios.tcgetattr(self._slave)[5]) if self._slave >= 0 else None

    def plug(self) -> None:
        if self._master >= 0:
            return
        check_link_is_free(self._link)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        try:
            if self._link.is_symlink():
                self._link.unlink()
            self._link.symlink_to(os.ttyname(self._slave))
        except OSError as error:
            self._release()
            raise BadInput(
                f"{self._link}: {error.strerror}.", "Name a link in a folder that you can write to."
            ) from error

    def unplug(self) -> None:
        """Close the pty, as when an adapter is pulled out."""
        if self._master >= 0:
            with contextlib.suppress(OSError):
                if os.readlink(self._link) == os.ttyname(self._slave):
                    self._link.unlink()
            self._release()

    def close(self) -> None:
        self.unplug()

    def _release(self) -> None:
        ends, self._master, self._slave, self._unsent = (self._slave, self._master), -1, -1, b""
        for end in ends:
            os.close(end)

    def _unread_bytes(self) -> int:
        """Return the number of bytes that the client has not read."""
        count = array.array("i", [0])
        fcntl.ioctl(self._slave, termios.FIONREAD, count)
        return count[0]

    def _flush(self) -> None:
        if self._unsent and self._master >= 0:
            with contextlib.suppress(BlockingIOError):
                self._unsent = self._unsent[os.write(self._master, self._unsent) :]


def check_link_is_free(link: Path) -> None:
    """Raise BadInput unless the place is free, or holds a link to a pty that no longer exists."""
    if link.is_symlink():
        target = os.readlink(link)
        if not target.startswith("/dev/pts/") or os.path.exists(target):
            raise BadInput(f"{link} exists and leads to {target}.", "Name another link, or remove it.")
    elif link.exists():
        raise BadInput(f"{link} exists and is no link of an emulator.", "Name another link; nothing is overwritten.")
