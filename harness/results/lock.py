"""Lock of a results folder. The operating system releases it however the holding process ends."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from harness.errors import BadInput

LOCK_FILE = ".lock"


@contextmanager
def folder_lock(out: Path) -> Iterator[None]:
    """Hold the lock of a folder, so that one process at a time writes there; BadInput when another process holds it."""
    try:
        with FileLock(out / LOCK_FILE, timeout=0):
            yield
    except Timeout as error:
        advice = f"`harness status {out}` shows its progress. Wait for it, or name another folder."
        raise BadInput(f"Another process uses {out}.", advice) from error


def is_running(out: Path) -> bool:
    """Whether a process holds the folder's lock, on this machine or on another one that shares the file system."""
    if not (out / LOCK_FILE).is_file():
        return False
    try:
        with FileLock(out / LOCK_FILE, timeout=0):
            return False
    except Timeout:
        return True
    except OSError:  # a folder that cannot be written: nobody works there
        return False
