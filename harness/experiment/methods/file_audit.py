"""Audit of what a method reads in its process: files below its own folders, and environment variables.

They must be part of the cell's key. Python reports every file that it opens (PEP 578). Files that a library in C opens,
and files of other processes, are not reported. Python has no event for variables; `os.environ` reports them.
"""

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from harness.core.working_folder import THREAD_VARIABLES
from harness.errors import HarnessError
from harness.reconstruct import CACHE_FOLDER, SourceFiles, foreign_folders, is_below, is_own, library_folders

_EVENTS = ("open", "sqlite3.connect", "ctypes.dlopen", "import")
_METADATA = ("METADATA", "PKG-INFO", "RECORD", "SOURCES.txt", "entry_points.txt", "requires.txt", "top_level.txt")
"""Files that an installer puts beside a method, in folders of these suffixes; Python reads its entry points there."""
_METADATA_FOLDERS = (".dist-info", ".egg-info")
_MACHINE_CODE = (".pyc", ".nbi", ".nbc")
"""Suffixes of code that Python and numba keep in `CACHE_FOLDER`. Size and time of the source tell whether it fits,
which an edit may leave as they are."""
_OPEN_FOLDERS = "/proc/self/fd"
"""Links to open files and folders on Linux."""
_PASSED_THROUGH = ("os", "collections", "collections.abc", "_collections_abc", "string", "configparser", __name__)
"""Modules whose functions read a variable for somebody else, such as `os.getenv`; so does `os.path.expandvars`."""
_listeners: list[Callable[[str, str], None]] = []


class UndeclaredInput(HarnessError):
    """A method reads a file or a variable that its key does not cover, or a file that has changed since."""

    def __init__(self, what: str, reason: str) -> None:
        super().__init__(what, reason)
        self.what, self.reason = self.args

    def __str__(self) -> str:
        return f"The method reads {self.what}, {self.reason}"


class FileAudit:
    """Records what this process reads, and refuses undeclared files and variables once `cover` was called.

    A refusal is kept in `violation`, so that a method that catches the exception is noticed all the same. Machine code
    that was kept of a user's source, or of the installed package that defines the method, is never read: it is as if it
    were not there.
    """

    def __init__(self) -> None:
        self.package = ""
        """Name of the package or module that defines the method, before it is imported."""
        self.violation: UndeclaredInput | None = None
        self._opened: dict[str, tuple[int, ...]] = {}
        self._variables: dict[str, str] = {}
        """Variable -> file of the code that read it."""
        self._folders: tuple[Path, ...] | None = None
        self._states: dict[str, tuple[int, ...]] = {}
        self._declared: set[str] = set()
        audit_environment(self._note_variable)
        sys.addaudithook(self._note_event)

    def cover(self, source: SourceFiles, variables: set[str]) -> None:
        """Watch the folders of a method from now on, and look at what was read before."""
        self._states = {name: _file_state(name) for file in source.files for name in _names(str(file))}
        self._folders = tuple(Path(name) for folder in source.folders for name in _names(str(folder)))
        self._declared = variables | {*THREAD_VARIABLES}  # the harness sets these itself
        with suppress(UndeclaredInput):  # kept in `violation`: every cell fails and says so
            for path, state in self._opened.items():
                if not _is_machine_code(path):  # of another installed package, as far as was known
                    self._check(path, state)
            for name, file in self._variables.items():
                self._note_variable(name, file)
        self._opened.clear()

    def _note_event(self, event: str, arguments: tuple[object, ...]) -> None:
        if event not in _EVENTS:
            return
        for path in _paths_read(event, arguments):
            if not os.path.isfile(path):
                continue
            if _is_machine_code(path) and path not in self._states and self._is_own(path, unknown=True):
                raise FileNotFoundError(errno.ENOENT, "kept machine code is not used", path)
            if self._folders is None:
                self._opened.setdefault(path, _file_state(path))
            else:
                self._check(path, _file_state(path))

    def _note_variable(self, name: str, file: str) -> None:
        if self._folders is None:
            self._variables.setdefault(name, file)
        elif name not in self._declared and os.path.isabs(file) and self._is_own(file):
            advice = "which is not declared. Add it to the list `environment` of its class."
            self._refuse(UndeclaredInput(f"the environment variable {name}", advice))

    def _is_own(self, path: str, *, unknown: bool = False) -> bool:
        """Whether a path belongs to the method; with `unknown`, also whether it is nobody else's as far as is known."""
        names = [Path(name) for name in _names(path)]
        if unknown and (not any(is_below(name, foreign_folders()) for name in names) or self._defines(names)):
            return True
        return any(is_own(name, self._folders or ()) for name in names)

    def _defines(self, names: list[Path]) -> bool:
        """Whether kept machine code is of the installed package or module that defines the method."""
        sources = [name.parent.parent / name.name.partition(".")[0] for name in names]
        return bool(self.package) and any(
            source.is_relative_to(folder) and source.relative_to(folder).parts[:1] == (self.package,)
            for source in sources
            for folder in library_folders()
        )

    def _check(self, path: str, state: tuple[int, ...]) -> None:
        if os.path.basename(path) in _METADATA and os.path.dirname(path).endswith(_METADATA_FOLDERS):
            return
        known = [self._states[name] for name in _names(path) if name in self._states]
        if not known and self._is_own(path):
            advice = "which is not declared. Add it to the list `files` of its class, or move it elsewhere."
            self._refuse(UndeclaredInput(path, advice))
        if known and state not in known:
            self._refuse(UndeclaredInput(path, "which has changed since the run began. Run again."))

    def _refuse(self, violation: UndeclaredInput) -> None:
        self.violation = violation
        raise violation


def _paths_read(event: str, arguments: tuple[object, ...]) -> Iterator[str]:
    """Absolute paths of the files that may be read in an event."""
    given = arguments[1 if event == "import" else 0]  # of an extension module; None for others
    if not isinstance(given, str | bytes | os.PathLike) or (event == "open" and not _reads(*arguments[1:3])):
        return
    name = os.fsdecode(given)
    yield os.path.abspath(name)
    if event == "sqlite3.connect" and name.startswith("file:"):
        yield os.path.abspath(unquote(urlsplit(name).path))
    if event == "open" and arguments[1] is None and not os.path.isabs(name):  # `os.open`, perhaps with `dir_fd`
        with suppress(OSError):
            for number in os.listdir(_OPEN_FOLDERS):
                with suppress(OSError):
                    yield os.path.abspath(os.path.join(os.readlink(f"{_OPEN_FOLDERS}/{number}"), name))


def _is_machine_code(path: str) -> bool:
    return path.endswith(_MACHINE_CODE) and CACHE_FOLDER in Path(path).parts


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
    """Times, size and place on the disk of a file: another state means another content.

    The time of the last change cannot be set by a program, unlike that of the last write.
    """
    try:
        found = os.stat(path)
    except OSError:
        return ()
    return found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino


class _AuditedEnvironment(os._Environ):  # type: ignore[type-arg]  # generic in type stubs alone
    def __getitem__(self, key: Any) -> Any:
        frame: Any = sys._getframe(1)
        while frame.f_back is not None and (
            frame.f_globals.get("__name__") in _PASSED_THROUGH or frame.f_code.co_name == "expandvars"
        ):
            frame = frame.f_back
        for hear in _listeners:
            hear(os.fsdecode(key), frame.f_code.co_filename)
        return super().__getitem__(key)

    def clear(self) -> None:
        for key in list(self):  # without a look at the values
            del self[key]


def audit_environment(hear: Callable[[str, str], None]) -> None:
    """Call `hear` with the name of each variable that is read from now on, and the file of the code that reads it."""
    _listeners.append(hear)
    for environment in (os.environ, getattr(os, "environb", os.environ)):
        environment.__class__ = _AuditedEnvironment
