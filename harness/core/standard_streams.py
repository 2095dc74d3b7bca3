"""The standard streams of the program: closed ones are replaced, and messages that nobody can read stop no work.

Characters that the encoding of a stream lacks are printed as escapes, such as \\xb1 for the sign of plus or minus.
"""

import io
import os
import sys
from typing import Any


def repair_streams() -> None:
    """Open closed standard streams on the null device, and make writing to stderr never fail.

    A file that is opened later would otherwise get the number of a closed stream, and receive what is printed.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free number, which is this one
    if sys.stdout is None:
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), "utf-8")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    raw = _MessageFile(2, "w", closefd=False)
    encoding = getattr(sys.stderr, "encoding", "utf-8")
    sys.stderr = io.TextIOWrapper(raw, encoding, "backslashreplace", line_buffering=True, write_through=True)


class _MessageFile(io.FileIO):
    """A file that takes what cannot be written, as when its disk is full or its reader has left."""

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except OSError:
            return len(data)


def discard_stdout() -> None:
    """Send later output to the null device: Python flushes stdout once more when it exits."""
    with open(os.devnull, "w") as null:
        os.dup2(null.fileno(), sys.stdout.fileno())
