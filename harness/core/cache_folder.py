"""The private folder of this user for files that the harness can make again, such as machine code.

What lies there is executed, so the folder must belong to the user, and nobody else may write to it.
"""

import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

_NAME = "tracker-harness"
MACHINE_CODE = "machine-code"
"""Folder in it of what numba has compiled."""


@cache
def cache_folder() -> Path | None:
    """The folder, which is made where it does not exist. None: nothing is kept, and every process compiles anew.

    It lies below NUMBA_CACHE_DIR if that is set, else in the user's cache folder. Where that one cannot be written, as
    in a read-only home, or is not private, it lies in the folder for temporary files.
    """
    return next((folder for folder in _candidates() if _make_private(folder)), None)


def remove_cache() -> int:
    """Remove the folder wherever it may lie; the number of bytes that were removed."""
    folders = [folder for folder in _candidates() if folder.is_dir() and _is_private(folder)]
    size_bytes = sum(map(folder_bytes, folders))
    for folder in folders:
        shutil.rmtree(folder, ignore_errors=True)
    cache_folder.cache_clear()
    return size_bytes - sum(map(folder_bytes, folders))


def folder_bytes(folder: Path) -> int:
    """Size of all files below a folder, 0 where there is none [bytes]."""
    sizes = []
    for file in folder.rglob("*"):
        with suppress(OSError):  # another process has removed it
            sizes.append(file.lstat().st_size if not file.is_dir() else 0)
    return sum(sizes)


def keep_newest(folder: Path, count: int) -> None:
    """Remove the folders in a folder except for the `count` that were used last."""
    ages = []
    for place in folder.iterdir():
        with suppress(OSError):
            ages.append((place.stat().st_mtime, place))
    for _, place in sorted(ages)[:-count]:
        shutil.rmtree(place, ignore_errors=True)


def _candidates() -> Iterator[Path]:
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen).absolute() / _NAME
        return
    with suppress(OSError, RuntimeError):  # a user without a home folder
        folder = user_cache_path(_NAME, appauthor=False)
        if folder.is_absolute():
            yield folder
    user = f"-{os.getuid()}" if hasattr(os, "getuid") else ""  # elsewhere each user has a folder for temporary files
    with suppress(OSError):
        yield Path(tempfile.gettempdir()) / f"{_NAME}{user}"


def _make_private(folder: Path) -> bool:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        return _is_private(folder) and os.access(folder, os.W_OK | os.X_OK)
    except OSError:
        return False


def _is_private(folder: Path) -> bool:
    """Whether a folder, no link, belongs to this user, and nobody else may write to it."""
    state = folder.lstat()
    own = not hasattr(os, "getuid") or (state.st_uid == os.getuid() and not state.st_mode & 0o022)
    return stat.S_ISDIR(state.st_mode) and own
