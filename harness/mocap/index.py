"""What a folder of a motion library holds: its files, and its index, which says what motion files do not record.

Symbolic links are followed inside the folder only. The index is `manifest.csv` at its top. Columns: path (relative to
the folder), subject, trial, behaviour, frames, fps and note. Only path is required. Paths are compared in Unicode's
composed form (NFC), with slashes.
"""

import csv
import io
import unicodedata
from collections.abc import Collection
from pathlib import Path, PurePath

from harness.core.csv_text import unescape_formula
from harness.core.files import TEMPORARY
from harness.core.input_file import read_input_file
from harness.errors import BadFile, BadInput
from harness.mocap.read.file_checks import check_size

FETCHED = ".fetch-"
"""Prefix of the name of the lock of `harness mocap fetch`, and of folders that earlier versions left."""


def scan_folder(folder: Path, suffixes: Collection[str]) -> tuple[list[Path], list[Path]]:
    """Files of a folder, at any depth, with lower-case `suffixes` such as ".amc", and ignored paths, both sorted.

    Links to files inside the folder are among the files. Ignored are links that lead outside the folder or to nothing,
    and folders that cannot be read.
    A link to a folder inside is not walked again: its files are found where they lie, so loops of links are harmless.
    """
    top = folder.resolve()
    files, ignored, waiting = [], [], [top]
    while waiting:
        parent = waiting.pop()
        try:
            paths = list(parent.iterdir())
        except PermissionError:
            ignored.append(parent)
            continue
        for path in paths:
            if path.name.startswith((TEMPORARY, FETCHED)):
                continue  # a process writes there, or was killed while it did
            link = path.is_symlink()
            if link and not (path.exists() and path.resolve().is_relative_to(top)):
                ignored.append(path)
            elif path.is_dir():
                waiting += [] if link else [path]
            elif path.suffix.lower() in suffixes and path.is_file():
                files.append(path)
    return sorted(files), sorted(ignored)


INDEX_NAME = "manifest.csv"
_LIMIT_BYTES = 16 * 2**20


def read_index(path: Path) -> dict[str, dict[str, str]]:
    """Rows of an index by `index_key` of their file; {} if there is no index.

    BadFile if it cannot be read, and for different rows of one file.
    """
    if not path.exists():
        return {}
    check_size(path, "an index of motion files", _LIMIT_BYTES)
    data = read_input_file(path, "an index of motion files", _LIMIT_BYTES)
    if b"\0" in data:
        raise BadFile(path, "binary data", "a table of comma-separated values", "Repair or remove it.")
    try:
        reader = csv.DictReader(io.StringIO(data.decode("utf-8"), newline=""), strict=True)
        rows = [(reader.line_num, _unescaped(row)) for row in reader]
    except (csv.Error, UnicodeDecodeError) as error:
        raise BadFile(path, str(error), "a table of comma-separated values", "Repair or remove it.") from error
    for line, row in rows:
        if not row.get("path"):
            raise BadFile(path, "a row without a path", "columns path, subject, behaviour, ...", "Repair it.", line)
        for text in row.values():
            if isinstance(text, str) and not text.isprintable():
                raise BadFile(path, f"the control character in {text[:60]!r}", "texts of one line", "Remove it.", line)
        for column, kind in (("frames", int), ("fps", float)):
            _check_number(path, row.get(column) or "", column, kind, line)
    found: dict[str, dict[str, str]] = {}
    for line, row in rows:
        row["path"] = index_key(row["path"])
        if found.setdefault(row["path"], row) != row:
            raise BadFile(
                path, f"{row['path']} twice, with different values", "a row for each file", "Repair it.", line
            )
    return found


def index_key(path: PurePath | str) -> str:
    """A path relative to the folder, as the index compares it."""
    return PurePath(unicodedata.normalize("NFC", str(path)).replace("\\", "/")).as_posix()


def _unescaped(row: dict[str, str]) -> dict[str, str]:
    return {name: unescape_formula(text) if isinstance(text, str) else text for name, text in row.items()}


def rate_from_index(path: Path, folders: tuple[Path, ...] = ()) -> float | None:
    """Frame rate of a motion file by the index of one of `folders`, or of the nearest folder above the file [Hz].

    None if no index names a rate for the file.
    """
    file = path.resolve()
    above = [folder for folder in file.parents if (folder / INDEX_NAME).exists()]
    for folder in [folder.resolve() for folder in folders] or above[:1]:
        if file.is_relative_to(folder):
            row = read_index(folder / INDEX_NAME).get(index_key(file.relative_to(folder)), {})
            if row.get("fps"):
                return float(row["fps"])
    return None


def unknown_rate_error(name: str) -> BadInput:
    """The error for an AMC file of unknown rate; it names every place where the rate can be given."""
    return BadInput(
        f"The frame rate of {name} is unknown: AMC files do not record it, and no {INDEX_NAME} has it.",
        f"Give it as `motion.rate_hz` in the scenario, in the column fps of {INDEX_NAME}, with --rate (`inspect`) "
        "or as `rate_hz` (`read_clip`). CMU's clips have 120 Hz, some 60.",
    )


def _check_number(path: Path, word: str, column: str, kind: type[int] | type[float], line: int) -> None:
    try:
        good = not word or 0 < kind(word) < 1e9
    except ValueError:
        good = False
    if not good:
        raise BadFile(path, f"{column} {word[:40]!r}", "a number above 0", "Repair the index.", line)
