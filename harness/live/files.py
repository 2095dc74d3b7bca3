"""Files that a live session writes: new ones, unless told."""

from pathlib import Path
from typing import BinaryIO

from harness.errors import BadFile


def created(path: Path, force: bool) -> BinaryIO:
    """An empty file, open to be written; BadFile when there is one already, but for `force`, or it cannot be made."""
    try:
        return path.open("wb" if force else "xb")
    except FileExistsError as error:
        raise BadFile(
            path, "it exists", "no such file yet", "Name another, or say --force to write over it."
        ) from error
    except OSError as error:
        raise BadFile(path, f"it cannot be written ({error.strerror})", "a file", "Name another.") from error
