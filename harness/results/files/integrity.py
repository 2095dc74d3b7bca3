"""Checks the files of a run or sweep against their digests before anything is read from them.

The index has the digests of manifest.json, summary.json and summary.csv. Cells are checked when they are read
(`cell.read_content`).
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from harness.core.files import MAX_JSON_BYTES
from harness.errors import BadFile
from harness.results.cell import OPTIONAL_COLUMNS, cell_folder, read_content, row_of_content
from harness.results.files.digests import check_file, file_digest, read_result_json
from harness.results.files.folder_kind import require_kind
from harness.results.index import INDEX_FILE, CellIndex
from harness.results.manifest import Manifest

SUMMARY = "summary.json"
MAX_SUMMARY_BYTES = 4 * MAX_JSON_BYTES
"""Largest summary that is read: that of a run of some 100,000 cells."""
DIGESTED_FILES = ("manifest.json", SUMMARY, "summary.csv")
"""Files of a run or sweep whose digests stand in the index."""
_ADVICE = "Give the command of the run again; finished cells are kept."


def check_folder(out: Path) -> None:
    """Check manifest, index, summary.json and summary.csv of a run or sweep, and that no finished cell is missing.

    While a process writes, and after one was killed, the index has no digest yet. Only the manifest and the presence of
    the cells are then checked. BadFile names the first file that is missing, damaged or edited.
    """
    if not ((out / "manifest.json").exists() and (out / INDEX_FILE).exists()):
        require_kind(out, "run", "sweep")
    Manifest.read(out / "manifest.json")
    check_index(out)


def check_cells(out: Path, rows: Iterable[Mapping[str, Any]] | None = None) -> None:
    """Check each cell of a run or sweep against its digests and its row.

    `rows` are those of summary.json, by default those of the index. BadFile names the first file that is missing,
    damaged, edited or contradicts another one.
    """
    with CellIndex(out, read_only=True) as index:
        path = index.path if rows is None else out / SUMMARY
        for row in index.rows() if rows is None else rows:
            folder = cell_folder(out, row["key"])
            check_row(path, row, row_of_content(folder, read_content(folder)))


def check_index(out: Path) -> None:
    """Check the index of a folder, the files that it names, and that no finished cell is missing; BadFile."""
    with CellIndex(out, read_only=True) as index:
        digests = index.check_digest()
        present = index.folders()
        if missing := [key for (key,) in index.columns("key") if key not in present]:
            expected = f"{index.counts().finished} finished cells"
            raise BadFile(cell_folder(out, missing[0]), "no such folder", expected, _ADVICE)
        try:
            for name, digest in (digests or {}).items():
                check_file(out / name, digest, f"the {name} that the index names", _ADVICE)
        except BadFile:
            if index.check_digest() == digests:  # otherwise another process began to write meanwhile
                raise


def compute_digests(out: Path) -> dict[str, str]:
    """The digests of `DIGESTED_FILES`; BadFile when one cannot be read."""
    return {name: file_digest(out / name, "a file of a run or sweep", _ADVICE) for name in DIGESTED_FILES}


def check_row(path: Path, row: Mapping[str, Any], cell: Mapping[str, Any]) -> None:
    """BadFile when a row that is stored in the file `path` differs from the row of its cell.

    Rows of versions without one of `cell.OPTIONAL_COLUMNS` count as having its default.
    """
    row = {**OPTIONAL_COLUMNS, **row}
    for name, value in cell.items():
        if row.get(name) != value:
            found = f"{name} of the cell {cell['key']} is {str(row.get(name))[:80]}"
            raise BadFile(path, found, f"{str(value)[:80]} as in its cell.json", _ADVICE)


def read_summary_json(out: Path) -> dict[str, Any]:
    """The content of summary.json; BadFile when it is missing, damaged or edited."""
    return read_result_json(out / SUMMARY, "the summary of a run or sweep", _ADVICE, MAX_SUMMARY_BYTES)
