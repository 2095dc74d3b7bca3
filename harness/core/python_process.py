"""Python processes that the harness starts: they never import from the working folder.

`python -m` and `python -c` put the working folder first on the import path. A file such as `ezc3d.py` among a user's
recordings would then be run. `-P` and PYTHONSAFEPATH leave the folder out.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.core.package_data import PACKAGE_FOLDER

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables by which every verb gives the libraries one thread: times are of one core, --jobs uses the others."""
_SAFE_PATH = "PYTHONSAFEPATH"
_HASH_SEED = "PYTHONHASHSEED"
_SITE_FOLDERS = ("site-packages", "dist-packages")


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
