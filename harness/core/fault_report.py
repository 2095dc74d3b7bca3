"""What a user is told of a fault of the system or of the program: one line, and a file with the traceback."""

import errno
import os
import shlex
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.errors import SystemFault, error_chain

MAX_CAUSE_CHARACTERS = 300
"""Longer causes are cut: a message may quote a whole file [choice]."""
_NO_SPACE = "Free some disk space, then give the same command again."
_REPEAT = "Give the same command again."
_CHECK_DISK = "Check that the folder can be written and its disk has space, then give the same command again."
_NOT_WRITABLE = "Name a place that can be written, then give the command again."
_SYSTEM_FAULTS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)
_DISK_FAULTS = (errno.ENOSPC, errno.EDQUOT, errno.EIO)
_COMPILER = "harness.core.compiled"
_ADVICE = {
    errno.ENOSPC: _NO_SPACE,
    errno.EDQUOT: _NO_SPACE,
    errno.EFBIG: _NO_SPACE,
    errno.EROFS: _NOT_WRITABLE,
    errno.EACCES: _NOT_WRITABLE,
    errno.EPERM: _NOT_WRITABLE,
    errno.ENOENT: "Something was removed while the program used it: put it back, then give the same command again.",
    errno.EMFILE: "Allow more open files (ulimit -n), then give the same command again.",
    errno.ENOMEM: "Free some memory or use fewer --jobs, then give the same command again.",
}

_SETTINGS_PREFIX = {
    "matplotlib": "MPL",
    "mujoco": "MUJOCO_",
    "numba": "NUMBA_",
    "numpy": "SOURCE_DATE_EPOCH",
    "tqdm": "TQDM_",
}
"""Library -> the beginning of the names of its environment variables."""


def is_system_fault(error: OSError) -> bool:
    """Whether an error is the system's, such as a full disk, and not of the name that was given."""
    return error.errno in _SYSTEM_FAULTS


def find_system_fault(error: BaseException) -> SystemFault | None:
    """The fault of the system behind an error that the code of a method has met; None where that code is to blame.

    Such are a full disk, and whatever keeps compiled functions from being made or loaded.
    """
    for cause in error_chain(error):
        if isinstance(cause, SystemFault):
            return cause
        compiling = any(f.f_globals.get("__name__") == _COMPILER for f, _ in traceback.walk_tb(cause.__traceback__))
        if isinstance(cause, OSError | RuntimeError) and compiling and not type(cause).__module__.startswith("numba."):
            return SystemFault(f"A function cannot be compiled ({cause}).", "Does `harness doctor` pass?")
        if isinstance(cause, OSError) and cause.errno in _DISK_FAULTS:
            return SystemFault(*describe_fault(cause))
    return None


@contextmanager
def named_folder_fault(folder: Path) -> Iterator[None]:
    """Turn an error of the operating system or of SQLite in the block into a SystemFault that names the folder."""
    import sqlite3  # here, since `harness --help` needs none of it

    try:
        yield
    except (OSError, sqlite3.Error) as error:
        if not folder.is_dir():
            raise SystemFault(f"The folder {folder} vanished.", _ADVICE[errno.ENOENT]) from error
        if isinstance(error, sqlite3.Error):
            raise SystemFault(f"{folder} cannot be written ({error}).", _CHECK_DISK) from error
        reason, advice = error.strerror or error, _ADVICE.get(error.errno or 0, _REPEAT)
        raise SystemFault(f"{folder} cannot be written ({reason}).", advice) from error


def describe_fault(error: BaseException) -> tuple[str, str]:
    """The cause of a fault, and what to do about it; one line each."""
    import sqlite3

    match error:
        case SystemFault():
            cause, advice = error.what, error.advice
        case MemoryError():
            cause, advice = f"not enough memory ({str(error) or 'MemoryError'}).", _ADVICE[errno.ENOMEM]
        case OSError() if error.errno is not None:
            names = " to ".join(str(name) for name in (error.filename, error.filename2) if name is not None)
            cause = f"{error.strerror or type(error).__name__}{f' ({names})' if names else ''}."
            advice = _ADVICE.get(error.errno, _REPEAT)
        case sqlite3.Error():
            cause = f"index.sqlite cannot be used ({error})."
            advice = _CHECK_DISK
        case _ if settings := _library_settings(error):
            cause = f"a library failed ({type(error).__name__}: {error}) where {settings} is set."
            advice = "Unset it, then give the same command again."
        case _:
            cause = f"a defect of the program ({type(error).__name__}: {error})."
            advice = "Please report it with the traceback."
    cause = " ".join(cause.split())
    return cause if len(cause) <= MAX_CAUSE_CHARACTERS else f"{cause[: MAX_CAUSE_CHARACTERS - 1]}…", advice


def _library_settings(error: BaseException) -> str:
    """The environment variables of the library in which an error arose, as NAME=VALUE; "" if there are none."""
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    library = str(frame.tb_frame.f_globals.get("__name__")).partition(".")[0] if frame else ""
    prefix = _SETTINGS_PREFIX.get(library)
    return " and ".join(f"{k}={v}" for k, v in sorted(os.environ.items()) if prefix and k.startswith(prefix))


def save_traceback(error: BaseException) -> str:
    """Write the traceback into a new file in the temporary folder; returns where it is, or why it is nowhere."""
    try:
        descriptor, path = tempfile.mkstemp(prefix="harness-traceback-", suffix=".txt")
        with open(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(f"{shlex.join(sys.argv)}\nPython {sys.version}\n\n")
            file.writelines(traceback.format_exception(error))
    except OSError as reason:
        return f"the traceback could not be saved ({reason.strerror or reason})"
    return f"traceback: {os.path.abspath(path)}"
