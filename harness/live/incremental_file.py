"""Files that a live session appends to and saves every second; no file is left without a frame.

Between two saves nothing is written, so that the file ends with a whole line whenever the process is killed.
An existing file is refused unless `force` is set, and is then replaced when the first frame is saved.
"""

import os
from io import FileIO
from pathlib import Path

from harness.core.fault_report import is_system_fault
from harness.errors import BadFile

_SAVE_PERIOD_S = 1.0


class IncrementalFile:
    """A file with a head, to which bytes are appended."""

    def __init__(self, path: Path, head: bytes, *, force: bool) -> None:
        """BadFile if the file exists and `force` is not set, or if it cannot be written."""
        if force and path.exists() and not path.is_file():
            raise BadFile(path, "it is not a regular file", "a file to replace", "Name another.")
        self.path = path.resolve() if force else path  # the target of a link is replaced, not the link
        self._written_path = self.path.with_name(f".unfinished-{self.path.name}") if force else path
        try:
            self._file: FileIO = self._written_path.open("wb" if force else "xb", buffering=0)
        except FileExistsError as error:
            advice = "Name another, or replace it with --force."
            raise BadFile(path, "it exists", "no such file yet", advice) from error
        except OSError as error:
            if is_system_fault(error):
                raise
            raise BadFile(path, f"it cannot be written ({error.strerror})", "a file", "Name another.") from error
        self._pending = bytearray(head)
        self._saved_s: float | None = None

    def write(self, data: bytes, now_s: float) -> bool:
        """Append whole lines; True when it is time to call `save`, once a second."""
        self._pending += data
        due = self._saved_s is None or now_s - self._saved_s > _SAVE_PERIOD_S
        self._saved_s = now_s if due else self._saved_s
        return due

    def save(self, patch: bytes = b"", offset: int = 0) -> None:
        """Write what was appended, and then overwrite bytes of the head at `offset` with `patch`."""
        while self._pending:
            del self._pending[: self._file.write(self._pending)]
        if patch:
            self._file.seek(offset)
            self._file.write(patch)
            self._file.seek(0, os.SEEK_END)
        if self._written_path != self.path and self._saved_s is not None:
            self._replace_existing()

    def close(self) -> None:
        """Close the file; remove it if nothing was saved after its head."""
        try:
            if self._saved_s is not None and not self.closed:
                self.save()
        finally:
            self._file.close()
            if self._saved_s is None or self._written_path != self.path:
                self._written_path.unlink(missing_ok=True)

    def _replace_existing(self) -> None:
        """Move the file to its final path; it is closed meanwhile, since Windows cannot move open files."""
        self._file.close()
        os.replace(self._written_path, self.path)
        self._written_path = self.path
        self._file = self.path.open("r+b", buffering=0)
        self._file.seek(0, os.SEEK_END)

    @property
    def closed(self) -> bool:
        return self._file.closed
