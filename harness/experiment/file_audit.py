"""Audit of the files that a method reads in its process: those below its own folder must be part of the cell's key.

Python reports every file that it opens (PEP 578). Files that a library in C opens, and files of other processes, are
not reported.
"""

import os
import sys
from contextlib import suppress
from pathlib import Path

from harness.errors import HarnessError
from harness.reconstruct.source_files import SourceFiles, foreign_folders, is_below

_METADATA = (".dist-info", ".egg-info")
"""Folders that an installer puts beside a method; Python reads its entry points there."""


class UndeclaredFile(HarnessError):
    """A method reads a file below its own folder that its key does not cover, or that has changed since."""

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(path, reason)
        self.path, self.reason = self.args

    def __str__(self) -> str:
        return f"The method reads {self.path}, {self.reason}"


class FileAudit:
    """Records the files that this process reads, and refuses undeclared ones once `cover` was called.

    A refusal is kept in `violation`, so that a method that catches the exception is noticed all the same.
    """

    def __init__(self) -> None:
        self.violation: UndeclaredFile | None = None
        self._opened: dict[str, tuple[int, ...]] = {}
        self._folders: tuple[Path, ...] | None = None
        self._states: dict[str, tuple[int, ...]] = {}
        sys.addaudithook(self._hear)

    def cover(self, source: SourceFiles) -> None:
        """Watch the folders of a method from now on, and look at what was read before."""
        self._states = {name: _file_state(name) for file in source.files for name in _names(str(file))}
        self._folders = tuple(Path(name) for folder in source.folders for name in _names(str(folder)))
        for path, state in self._opened.items():
            with suppress(UndeclaredFile):  # kept in `violation`: every cell fails and says so
                self._check(path, state)
        self._opened.clear()

    def _hear(self, event: str, arguments: tuple[object, ...]) -> None:
        if event not in ("open", "sqlite3.connect") or not isinstance(arguments[0], str | bytes | os.PathLike):
            return
        path = os.path.abspath(os.fsdecode(arguments[0]))
        if (event == "open" and not _reads(*arguments[1:3])) or not os.path.isfile(path):
            return
        if self._folders is None:
            self._opened.setdefault(path, _file_state(path))
        else:
            self._check(path, _file_state(path))

    def _check(self, path: str, state: tuple[int, ...]) -> None:
        if self._folders is None or any(part == "__pycache__" or part.endswith(_METADATA) for part in Path(path).parts):
            return
        names = [Path(name) for name in _names(path)]
        if not any(is_below(name, self._folders) for name in names):
            return
        if any(is_below(name, foreign_folders()) for name in names):
            return
        known = [self._states[str(name)] for name in names if str(name) in self._states]
        if not known:
            advice = "which is not declared. Add it to the list `files` of its class, or move it elsewhere."
            self.violation = UndeclaredFile(path, advice)
            raise self.violation
        if state not in known:
            self.violation = UndeclaredFile(path, "which has changed since the run began. Run again.")
            raise self.violation


def _reads(mode: object, flags: object) -> bool:
    """Whether what was opened so can be read with earlier content."""
    if isinstance(mode, str):
        return "r" in mode or ("+" in mode and "a" in mode)
    written_only = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR) == os.O_WRONLY
    emptied = isinstance(flags, int) and bool(flags & os.O_TRUNC)
    return not (written_only or emptied)


def _names(path: str) -> tuple[str, ...]:
    """A path, and the path with its links resolved."""
    return tuple(dict.fromkeys((path, os.path.realpath(path))))


def _file_state(path: str) -> tuple[int, ...]:
    """Time, size and place on the disk of a file: another state means another content."""
    try:
        found = os.stat(path)
    except OSError:
        return ()
    return found.st_mtime_ns, found.st_size, found.st_ino
