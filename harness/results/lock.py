"""Who is at work in a folder: a lock that the system lets go of however its holder ended."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from harness.errors import BadInput

LOCK_FILE = ".lock"


@contextmanager
def folder_lock(out: Path, *, alone: bool = True) -> Iterator[None]:
    """While this process works there, beside others only if none of them is `alone`; BadInput."""
    handle = os.open(out / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        try:
            fcntl.flock(handle, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise BadInput(
                f"Another process is at work in {out}.", f"`harness status {out}` says how far it is; or name another."
            ) from error
        yield
    finally:
        os.close(handle)


def is_running(out: Path) -> bool:
    """Whether any process works there, on this machine or on the same file system."""
    try:
        handle = os.open(out / LOCK_FILE, os.O_RDWR)
    except FileNotFoundError:
        return False
    try:
        with suppress(BlockingIOError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return False
        return True
    finally:
        os.close(handle)
