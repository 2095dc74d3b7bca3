"""Modules of the working folder: the one that a command names, and what that module imports from beside it.

A user's own method may lie in the working folder. The folder is not on the import path: a library that tries an import,
such as `yaml` or `coverage`, would run a file of that name.
"""

import os
import sys
from collections.abc import Iterable, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import FrameType, ModuleType

from harness.core.package_data import PACKAGE_FOLDER

_SITE_FOLDERS = ("site-packages", "dist-packages")


class FolderFinder(MetaPathFinder):
    """Finds the named modules of a folder, and those that modules of the folder import, after all other finders."""

    def __init__(self, folder: str) -> None:
        self.folder = os.path.abspath(folder)
        self.names = set[str]()
        """Modules that anybody may import, because a command names them."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if path is None and (fullname in self.names or self._contains(_importer(sys._getframe(1)))):
            return PathFinder.find_spec(fullname, [self.folder])
        return None

    def _contains(self, file: str) -> bool:
        """Whether a file is code of the folder, and not of Python, a library or the harness that lie below it."""
        if not _is_below(file, self.folder) or any(name in file.split(os.sep) for name in _SITE_FOLDERS):
            return False
        return not any(_is_below(file, place) for place in (str(PACKAGE_FOLDER), sys.prefix, sys.base_prefix))


def serve_folder(folder: str, names: Iterable[str] = ()) -> None:
    """Find the modules of a user's methods in a folder from now on; `names` are those that a command names."""
    if os.path.abspath(folder) not in served_folders():
        sys.meta_path.append(FolderFinder(folder))
    for finder in _finders():
        finder.names.update(names)


def served_folders() -> dict[str, list[str]]:
    """Each folder in which modules are found beside those of `sys.path`, with the named ones: for another process."""
    return {finder.folder: sorted(finder.names) for finder in _finders()}


def name_module(module: str) -> None:
    """Let a module of these folders be imported, because a command names it."""
    for finder in _finders():
        finder.names.add(module.partition(".")[0])


def leave_relative_folders_out() -> None:
    """Take relative folders of PYTHONPATH off the import path; `:` at an end adds an empty one, the working folder."""
    entries = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    library = os.path.dirname(os.__file__)
    if len(entries) > 1 or entries[0]:
        relative = {os.path.abspath(entry) for entry in entries if not os.path.isabs(entry)} - {*entries}
        given = sys.path[: sys.path.index(library)] if library in sys.path else []
        sys.path[: len(given)] = [entry for entry in given if os.path.abspath(entry) not in relative]


def _finders() -> list[FolderFinder]:
    return [finder for finder in sys.meta_path if isinstance(finder, FolderFinder)]


def _importer(frame: FrameType | None) -> str:
    """The file of the code that imports."""
    while frame is not None and str(frame.f_globals.get("__name__")).partition(".")[0] in ("importlib", "pickle"):
        frame = frame.f_back
    return os.path.abspath(frame.f_code.co_filename) if frame is not None else ""


def _is_below(file: str, folder: str) -> bool:
    return file.startswith(os.path.join(folder, ""))
