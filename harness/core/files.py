"""JSON with the same text for the same content, atomic writers, files that a user names for output, and readers."""

import hashlib
import json
import math
import os
import re
import shutil
import socket
import time
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core import parsing
from harness.core.fault_report import is_system_fault
from harness.core.file_kind import wrong_file
from harness.core.input_file import MEGABYTE, read_input_file
from harness.core.output_place import place_fault
from harness.errors import BadFile

TEMPORARY = ".unfinished-"
"""Prefix of the names of files and folders that are still being written; a killed process leaves them behind."""
JSON_ADVICE = "Is this a folder written by `harness run`?"
_ABANDONED_S = 86400.0
"""Age of a temporary file of another name, or of an unknown computer, that no process writes any more [s, choice]."""
MAX_TOML_BYTES = MEGABYTE
"""Largest TOML file that is read [choice]: the largest that the harness writes has some 10 kB."""
MAX_JSON_BYTES = 64 * MEGABYTE
"""Largest JSON file that is read, where the reader gives no other limit [choice]."""


def to_json_types(value: Any) -> Any:
    """Convert a value to JSON's types; NaN and infinity become null."""
    match value:
        case Mapping():
            return {str(key): to_json_types(item) for key, item in value.items()}
        case np.ndarray() | np.generic():
            return to_json_types(value.tolist())
        case list() | tuple():
            return [to_json_types(item) for item in value]
        case Enum():
            return to_json_types(value.value)
        case Path():
            return value.as_posix()
        case float():
            return value if math.isfinite(value) else None
        case _:
            return value


def content_key(content: Any) -> str:
    """Hash of some content, 32 hex digits, independent of the order of its keys."""
    text = json.dumps(to_json_types(content), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


_DIGEST_GRID = 1e-5
"""Spacing of the values that `digest` tells apart: 10 um, or 0.0006 deg. Processors differ by less than 1e-14."""
_DIGEST_OFFSET = 0.381966
"""Part of the spacing that keeps decimal numbers, such as 0.1234505, away from the edges of the grid."""


def digest(*arrays: NDArray[Any]) -> str:
    """Hash of the values and shapes of arrays, 16 hex digits.

    Values are rounded to a grid of 1e-5 (m or rad), so that motion computed on another processor has the same hash.
    """
    state = hashlib.blake2b(digest_size=8)
    for array in arrays:
        state.update(str(array.shape).encode())
        steps = np.floor(np.asarray(array, dtype="<f8") / _DIGEST_GRID + _DIGEST_OFFSET)
        state.update(np.ascontiguousarray(steps + 0.0).tobytes())  # -0 and 0 have different bytes
    return state.hexdigest()


def temporary_path(path: Path) -> Path:
    """The name under which this process writes a file or folder before it moves it to `path`."""
    return path.with_name(f"{TEMPORARY}{_host()}{os.getpid()}-{path.name}")


@cache
def _host() -> str:
    """Short name of this computer, as the beginning of its temporary names."""
    return hashlib.blake2b(socket.gethostname().encode(), digest_size=4).hexdigest() + "-"


def remove_leftovers(path: Path) -> None:
    """Remove what dead processes of this computer left behind when they wrote this file or folder.

    Whatever else they left in the parent folder goes a day after it was written last. So do files of version 23b301b7,
    whose names do not tell the computer.
    """
    names = re.compile(rf"{re.escape(TEMPORARY)}({_host()})?(\d{{1,7}})-(.+)", re.DOTALL)
    for leftover in path.parent.glob(f"{TEMPORARY}*"):
        match = names.fullmatch(leftover.name)
        if match is None or _is_alive(int(match[2])):
            continue
        with suppress(OSError):
            ours = match[1] and match[3] == path.name
            if not ours and time.time() - leftover.lstat().st_mtime < _ABANDONED_S:
                continue
            if leftover.is_dir() and not leftover.is_symlink():
                shutil.rmtree(leftover, ignore_errors=True)
            else:
                leftover.unlink()


def _is_alive(process: int) -> bool:
    """Whether a process of this computer may still run; Windows cannot be asked without ending it."""
    if os.name == "nt":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def move_into_place(temporary: Path, path: Path, *, flush_name: bool = True) -> None:
    """Flush a finished file or folder to the disk and rename it: readers see the old state or the new one, never less.

    An existing file is replaced; OSError when `path` is a folder with anything in it. Of a folder that is moved, the
    files inside have to be flushed before (`flush`). Without `flush_name` the new name is not flushed: a loss of power
    may lose the file or folder, but leaves no part of it.
    """
    flush(temporary)
    os.replace(temporary, path)
    if flush_name:
        flush(path.parent)


def flush(path: Path) -> None:
    """Flush a file, or the list of names in a folder, to the disk (fsync); Windows flushes no folders."""
    if os.name == "nt" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDWR if path.is_file() else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def flush_together(paths: Iterable[Path]) -> None:
    """Flush several files at the same time: most file systems then write to the disk once."""
    paths = list(paths)
    with ThreadPoolExecutor(len(paths)) as pool:
        list(pool.map(flush, paths))


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary path to write a file to, which takes the place of `path` when the block ends without an error."""
    temporary = temporary_path(path)
    remove_leftovers(path)
    try:
        yield temporary
        move_into_place(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file atomically (see `move_into_place`)."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8 atomically, its line ends unchanged."""
    write_parts(path, [text])


def write_parts(path: Path, texts: Iterable[str]) -> None:
    """Write a text file atomically from its parts, one after another."""
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        file.writelines(texts)


def write_npz(path: Path, **arrays: Any) -> None:
    """Write arrays by name atomically, as `numpy.savez` does."""
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)


def write_json(path: Path, content: Any) -> None:
    """Write content as JSON atomically (see `to_json`)."""
    write_text(path, to_json(content))


def to_json(content: Any) -> str:
    """JSON text of the content, indented by one space; NaN and infinity become null."""
    return json.dumps(to_json_types(content), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def read_json(
    path: Path, expected: str, advice: str = JSON_ADVICE, limit_bytes: int = MAX_JSON_BYTES
) -> dict[str, Any]:
    """Read a JSON object; BadFile, which says what was expected and what to try, when the file holds none."""
    return parse_json(path, read_input_file(path, expected, limit_bytes, advice), expected, advice)


def parse_json(path: Path, data: bytes, expected: str, advice: str) -> dict[str, Any]:
    """The JSON object in the content of a file; BadFile when there is none."""
    try:
        content = parsing.parse_json(data.decode("utf-8"))
    except ValueError as error:
        raise wrong_file(path, f"not JSON: {_text_fault(error)}", expected, advice) from error
    if not isinstance(content, dict):
        raise BadFile(path, f"a JSON {type(content).__name__}", expected, advice)
    return content


def read_toml(path: Path, expected: str, advice: str) -> dict[str, Any]:
    """Read a TOML file of at most MAX_TOML_BYTES; BadFile, in one line, when there is none or it is no TOML.

    `expected` and `advice` complete the message: what the file should be, and what to try.
    """
    return parse_toml(path, read_input_file(path, expected, MAX_TOML_BYTES, advice), expected, advice)


def parse_toml(path: Path, data: bytes, expected: str, advice: str) -> dict[str, Any]:
    """The content of a TOML file; BadFile, in one line, when it is no TOML."""
    try:
        return parsing.parse_toml(data.decode("utf-8").replace("\r\n", "\n"))
    except ValueError as error:
        raise wrong_file(path, f"not TOML: {_text_fault(error)}", expected, advice) from error


def _text_fault(error: ValueError) -> str:
    """What is wrong with a text that cannot be parsed."""
    return f"byte {error.start + 1} is not UTF-8" if isinstance(error, UnicodeDecodeError) else str(error)


def require_writable(path: Path, what: str, *, force: bool) -> None:
    """BadFile when `what`, such as "a calibration", cannot be written to this path, or would replace a file.

    `force` allows the replacement.
    """
    if path.exists() and not path.is_file():
        raise BadFile(path, "it is not a file", f"a file name for {what}", "Choose another.")
    if path.exists() and not force:
        raise BadFile(path, "it exists", "a new file", "Choose another name, or overwrite it with --force.")
    if fault := place_fault(path.parent):
        raise BadFile(path, fault, f"a file name for {what}", "Choose another.")


def write_output(path: Path, content: str | bytes, what: str, *, force: bool) -> None:
    """Write a file atomically, a text in UTF-8, and make its folder; BadFile as `require_writable`."""
    require_writable(path, what, force=force)
    target = path.resolve()  # a symbolic link stays; its target is replaced
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(target, content if isinstance(content, bytes) else content.encode("utf-8", errors="replace"))
    except OSError as error:
        if is_system_fault(error):
            raise
        raise BadFile(path, f"it cannot be written ({error.strerror})", "a file", "Choose another.") from error
