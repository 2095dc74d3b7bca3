"""Whether files can be written at a place: a verb that works for long finds out before it begins."""

import os
from pathlib import Path


def place_fault(path: Path) -> str:
    """Reason why no file can be written into a folder, or why the folder cannot be made; "" if it can.

    A temporary file is made and removed: permissions alone do not tell of a disk that can only be read.
    """
    from tempfile import TemporaryFile  # imported here: `--help` starts in a moment

    place = next(each for each in (path, *path.absolute().parents) if os.path.lexists(each))
    if not place.is_dir():
        return f"{place} is a file, not a folder"
    try:
        with TemporaryFile(dir=place):
            return ""
    except OSError as error:
        return f"the folder {place} cannot be written ({error.strerror})"
