"""Files that a live session writes: new ones, unless told; on the disk every second; none at all of no frame.

One that is to be written over stays as it was until there is a frame to put in its place.
"""

import os
from pathlib import Path
from typing import BinaryIO

from harness.errors import BadFile

_SAVE_PERIOD_S = 1.0


class IncrementalFile:
    """A file that grows by runs of bytes after a head."""

    def __init__(self, path: Path, head: bytes, *, force: bool) -> None:
        """BadFile when there is one and it is not to be written over, or when it cannot be written."""
        if force and path.exists() and not path.is_file():
            raise BadFile(path, "it is no file", "one to write over", "Name another.")
        self.path = path.resolve() if force else path  # what a link points to is replaced, not the link
        self._at = self.path.with_name(f".unfinished-{self.path.name}") if force else path
        try:
            self._file: BinaryIO = self._at.open("wb" if force else "xb")
        except FileExistsError as error:
            advice = "Name another, or say --force to write over it."
            raise BadFile(path, "it exists", "no such file yet", advice) from error
        except OSError as error:
            raise BadFile(path, f"it cannot be written ({error.strerror})", "a file", "Name another.") from error
        self._file.write(head)
        self._saved_s: float | None = None

    def write(self, data: bytes, now_s: float) -> bool:
        """Append; True when it is time to `save`, which is once a second."""
        self._file.write(data)
        due = self._saved_s is None or now_s - self._saved_s > _SAVE_PERIOD_S
        self._saved_s = now_s if due else self._saved_s
        return due

    def save(self, patch: bytes = b"", at: int = 0) -> None:
        """All that was written, and some bytes of the head anew."""
        if patch:
            self._file.seek(at)
            self._file.write(patch)
            self._file.seek(0, os.SEEK_END)
        self._file.flush()
        if self._at != self.path and self._saved_s is not None:
            self._take_place()

    def close(self) -> None:
        """A file that never got anything after its head is removed, and so is one that never took its place."""
        try:
            self._file.close()
        finally:
            if self._saved_s is None or self._at != self.path:
                self._at.unlink(missing_ok=True)

    def _take_place(self) -> None:
        """Of the file that is written over; closed meanwhile, since Windows moves no open file."""
        self._file.close()
        os.replace(self._at, self.path)
        self._at = self.path
        self._file = self.path.open("r+b")
        self._file.seek(0, os.SEEK_END)

    @property
    def closed(self) -> bool:
        return self._file.closed
