"""Files that a user names for output: checked before the work, never overwritten without being asked, written whole."""

from pathlib import Path

from harness.core.fault_report import is_system_fault
from harness.core.files import write_bytes
from harness.errors import BadFile


def require_writable(path: Path, what: str, *, force: bool) -> None:
    """BadFile when `what`, such as "a calibration", cannot be written to this path, or would replace a file.

    `force` allows the replacement.
    """
    if path.exists() and not path.is_file():
        raise BadFile(path, "it is not a file", f"a file name for {what}", "Choose another.")
    if path.exists() and not force:
        raise BadFile(path, "it exists", "a new file", "Choose another name, or overwrite it with --force.")
    if not path.absolute().parent.is_dir():
        raise BadFile(path, "the folder does not exist", f"a file name for {what}", "Create it, or choose another.")


def write_output(path: Path, text: str, what: str, *, force: bool) -> None:
    """Write a text in UTF-8 atomically; BadFile as `require_writable`, and where the system refuses the file."""
    require_writable(path, what, force=force)
    target = path.resolve()  # a symbolic link stays; its target is replaced
    try:
        write_bytes(target, text.encode("utf-8", errors="replace"))
    except OSError as error:
        if is_system_fault(error):
            raise
        raise BadFile(path, f"it cannot be written ({error.strerror})", "a file", "Choose another.") from error
