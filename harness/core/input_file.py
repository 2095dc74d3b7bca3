"""Files from outside: only regular files are read, and none larger than the limit of its kind.

A device or a FIFO is not even opened: opening one may wait for ever, or change the device.
"""

import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from harness.errors import BadFile

MEGABYTE = 2**20
_OTHER_KINDS: tuple[tuple[Callable[[int], bool], str], ...] = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a FIFO"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def check_input_file(path: Path, expected: str, limit_bytes: int, advice: str = "Check the path.") -> int:
    """Size of a file [bytes]; BadFile unless it is a regular file of at most `limit_bytes`. It is not opened."""
    try:
        status = os.stat(path)
    except FileNotFoundError as error:
        raise BadFile(path, "no such file", expected, advice) from error
    except (OSError, ValueError) as error:  # a name with a NUL character gives a ValueError
        raise BadFile(path, f"it cannot be read ({_reason(error)})", expected, advice) from error
    for is_kind, name in _OTHER_KINDS:
        if is_kind(status.st_mode):
            raise BadFile(path, f"{name}, not a regular file", expected, advice)
    if status.st_size > limit_bytes:
        limit = f"{expected} of at most {limit_bytes:,} bytes"
        raise BadFile(path, f"a file of {status.st_size:,} bytes", limit, "Is it the right file?")
    return status.st_size


def read_input_file(path: Path, expected: str, limit_bytes: int, advice: str = "Check the path.") -> bytes:
    """The content of a file; BadFile as `check_input_file`, and where it cannot be read."""
    try:
        with open_input_file(path, expected, limit_bytes, advice) as file:
            data = file.read(limit_bytes + 1)
    except OSError as error:
        raise BadFile(path, f"it cannot be read ({_reason(error)})", expected, advice) from error
    if len(data) > limit_bytes:  # it grew, or is one of the files of /proc, which have no size
        limit = f"{expected} of at most {limit_bytes:,} bytes"
        raise BadFile(path, f"a file of more than {limit_bytes:,} bytes", limit, "Is it the right file?")
    return data


def open_input_file(path: Path, expected: str, limit_bytes: int, advice: str = "Check the path.") -> BinaryIO:
    """A file that is open for reading; BadFile as `check_input_file`, and where it cannot be opened."""
    check_input_file(path, expected, limit_bytes, advice)
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
    try:
        return open(os.open(path, flags), "rb")
    except OSError as error:
        raise BadFile(path, f"it cannot be read ({_reason(error)})", expected, advice) from error


def names_input_file(path: Path) -> bool:
    """Whether something other than a folder has this name; False for a name that no file can have."""
    try:
        return not stat.S_ISDIR(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
