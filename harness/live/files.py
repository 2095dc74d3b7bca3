"""Files that a live session writes: new ones, unless told; on the disk every second; none at all of no frame."""

import os
from pathlib import Path

from harness.errors import BadFile

_SAVE_S = 1.0


class Written:
    """A file that grows by runs of bytes after a head."""

    def __init__(self, path: Path, head: bytes, *, force: bool) -> None:
        """BadFile when there is one and it is not to be written over, or when it cannot be written."""
        self.path = path
        try:
            self._file = path.open("wb" if force else "xb")
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
        due = self._saved_s is None or now_s - self._saved_s > _SAVE_S
        self._saved_s = now_s if due else self._saved_s
        return due

    def save(self, patch: bytes = b"", at: int = 0) -> None:
        """All that was written, and some bytes of the head anew."""
        if patch:
            self._file.seek(at)
            self._file.write(patch)
            self._file.seek(0, os.SEEK_END)
        self._file.flush()

    def close(self) -> None:
        """A file that never got anything after its head is removed."""
        self._file.close()
        if self._saved_s is None:
            self.path.unlink(missing_ok=True)

    @property
    def closed(self) -> bool:
        return self._file.closed
