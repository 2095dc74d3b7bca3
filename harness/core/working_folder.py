"""The working folder: what Python imports and libraries read from it.

It is not on the import path. `python -m` and `python -c` put it first there, and a file such as `ezc3d.py` among a
user's recordings would then be run; `-P` and PYTHONSAFEPATH leave it out. A user's own method may lie in it: the module
that a command names is found, and what that module imports from beside it.

Libraries are imported with their own defaults. On import MuJoCo loads the renderer that MUJOCO_GL names, which the
harness never uses. matplotlib reads a `matplotlibrc` and numba a `.numba_config.yaml` of the working folder. Such a
file or variable would change pages, or end every verb.
"""

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import FrameType, ModuleType

from harness.core.package_data import PACKAGE_FOLDER

_SITE_FOLDERS = ("site-packages", "dist-packages")


class FolderFinder:
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


THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables by which every verb gives the libraries one thread: times are of one core, --jobs uses the others."""
_SAFE_PATH = "PYTHONSAFEPATH"
_HASH_SEED = "PYTHONHASHSEED"


def python_command(*arguments: str) -> list[str]:
    """The words that start this Python with `arguments`, such as "-m" and a module; see `python_environment`."""
    return [sys.executable, "-P", *arguments]


def python_environment() -> dict[str, str]:
    """The environment of such a process: it imports this harness, and nothing from relative folders of PYTHONPATH.

    Hashes of texts, hence the order of sets, are the same in all of them, so that a method computes the same.
    """
    root = PACKAGE_FOLDER.parent
    folders = [folder for folder in os.environ.get("PYTHONPATH", "").split(os.pathsep) if os.path.isabs(folder)]
    if root.name not in _SITE_FOLDERS and str(root) not in folders:
        folders.append(str(root))  # a checkout that is not installed
    return {**os.environ, _SAFE_PATH: "1", _HASH_SEED: "0", "PYTHONPATH": os.pathsep.join(folders)}


@contextmanager
def safe_import_path() -> Iterator[None]:
    """Python processes that `multiprocessing` starts in the block do not import from the working folder."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


def leave_working_folder_out(folder: str) -> None:
    """Leave the working folder, which `python -m` puts first and `__main__` takes off, out of the import path.

    A checkout of the harness that is the working folder moves behind the standard library, so that worker processes
    import the same harness. "" stands for no folder.
    """
    if folder and Path(folder).resolve() == PACKAGE_FOLDER.parent.resolve():
        sites = [place for place, name in enumerate(sys.path) if Path(name).name in _SITE_FOLDERS]
        sys.path.insert(sites[0] if sites else len(sys.path), folder)


_ENVIRONMENT = {
    "MATPLOTLIBRC": os.devnull,  # an empty file of settings
    "MPLBACKEND": "agg",
    "MUJOCO_GL": "disable",
}
WORKING_FOLDER_FILES = ("matplotlibrc", ".numba_config.yaml")
"""Files of settings that libraries look for in the working folder."""


@contextmanager
def plain_import() -> Iterator[None]:
    """Libraries that are first imported in the block have their default settings and read none of a folder.

    The environment is as before afterwards. A variable such as NUMBA_NUM_THREADS, which no library reads on import
    alone, counts as ever.
    """
    before = {name: os.environ.get(name) for name in _ENVIRONMENT}
    exists = os.path.exists
    os.environ.update(_ENVIRONMENT)
    vars(os.path)["exists"] = lambda path: path not in WORKING_FOLDER_FILES and exists(path)
    try:
        yield
    finally:
        vars(os.path)["exists"] = exists
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
