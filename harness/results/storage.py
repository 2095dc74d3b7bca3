"""The folder of a run or a sweep: manifest.json, cells/, index.sqlite, summary.json and summary.csv.

A cell that is present is finished, so that running the same scenario again resumes it. A cell's key is a hash of its
inputs, the method and the source of both, so that edited code never reuses stale results.
"""

import shutil
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from harness.core.files import TEMPORARY, content_key, digest, to_json_types
from harness.core.ranges import check_words
from harness.core.stream_health import BAUD, describe_line_loss
from harness.errors import BadFile, BadInput, Outcome
from harness.results.cell import Cell, as_row, cell_folder, has_cell, read_cell, write_cell
from harness.results.files.content_types import (
    check_summary_types,
    find_impossible_metric,
    find_impossible_sigma,
    find_impossible_statistic,
)
from harness.results.files.digests import STUDY_FILE, read_result_json, write_result_json
from harness.results.files.folder_kind import LOCK_FILE, folder_lock
from harness.results.files.integrity import SUMMARY, check_folder, check_row, compute_digests, read_summary_json
from harness.results.index import CellIndex
from harness.results.manifest import Manifest
from harness.results.table import compute_group_statistics, write_table

__all__ = [
    "Cell",
    "cell_key",
    "digest",
    "has_cell",
    "open_folder",
    "open_run",
    "open_study",
    "read_cell",
    "read_cells",
    "read_summary",
    "remove_leftovers",
    "write_cell",
    "write_summary",
]


_SUMMARY_KEYS = ("outcome", "cells_finished", "cells_planned", "failures", "methods", "behaviours", "cells")


def cell_key(inputs: Mapping[str, Any], method: Mapping[str, Any], source_hash: str) -> str:
    """Key of a cell: a hash of everything that defines it, so that equal keys mean equal results."""
    return content_key({"inputs": inputs, "method": method, "source": source_hash})


@contextmanager
def open_folder(
    out: Path, identity_file: str, identity: Mapping[str, Any], kind: str, difference: Callable[[Path], str]
) -> Iterator[None]:
    """Create a results folder and its `identity_file`, or open it to resume, and hold its lock in the block.

    `difference` says in what an existing identity file differs, "" if it does not. BadInput when it differs, when the
    folder holds other files, when its name is no folder's, and when another process holds the lock. A folder that is
    refused is left as it was.
    """

    def check() -> None:
        advice = "Name another folder with --out, or delete this one."
        if out.exists() and not out.is_dir():
            raise BadInput(f"{out} is a file.", "Name a folder with --out.")
        names = {path.name for path in out.iterdir()} if out.is_dir() else set()
        names = {name for name in names if not name.startswith(TEMPORARY) and name != LOCK_FILE}
        if identity_file in names:
            if text := difference(out / identity_file):
                raise BadInput(f"{out} holds another {kind} ({text}).", advice)
        elif names:
            raise BadInput(f"{out} holds files that are no {kind} ({', '.join(sorted(names)[:3])}).", advice)

    check_words(out)
    check()  # before the lock, whose file would be a change
    try:
        out.mkdir(parents=True, exist_ok=True)
    except (NotADirectoryError, FileExistsError) as error:  # the name of a folder in it is a file's
        raise BadInput(f"{out} cannot be made ({error.strerror}).", "Name another folder with --out.") from error
    with folder_lock(out):
        check()  # another process may have made it meanwhile
        write_result_json(out / identity_file, identity)  # first: it tells later that the folder is ours
        yield


@contextmanager
def open_run(out: Path, manifest: Manifest) -> Iterator[None]:
    """Create the folder of a run or sweep, or open it to resume, and hold its lock; BadInput as `open_folder`."""

    def difference(path: Path) -> str:
        keys = manifest.differences(Manifest.read(path))
        return f"differs in {', '.join(keys)}" if keys else ""

    with open_folder(out, "manifest.json", manifest.as_dict(), "run", difference):
        (out / "cells").mkdir(exist_ok=True)
        yield


def open_study(out: Path, identity: Mapping[str, Any]) -> AbstractContextManager[None]:
    """Create a study's folder, or open it to resume, and hold its lock; BadInput as `open_folder`."""

    def difference(path: Path) -> str:
        advice = "Restore it from a copy, or name another folder with --out."
        stored, given = read_result_json(path, "the identity of a study", advice), to_json_types(identity)
        return "; ".join(f"{k}: {stored.get(k)}, not {given[k]}" for k in given if stored.get(k) != given[k])

    return open_folder(out, STUDY_FILE, identity, "study", difference)


def read_summary(out: Path) -> dict[str, Any]:
    """The summary of a run.

    BadFile when it is damaged or edited, is a sweep's, names cells outside the folder, or has impossible values.
    """
    path, expected = out / SUMMARY, "the summary of a run"
    content = read_summary_json(out)
    advice = "Give the command of the run again."
    if missing := [name for name in _SUMMARY_KEYS if name not in content]:
        raise BadFile(path, f"no {', '.join(missing)}", expected, advice)
    for row in content["recovery"] if isinstance(content.get("recovery"), list) else ():
        if isinstance(row, dict) and "judged" in row:  # its name in earlier versions
            row["evaluated_frames"] = row.pop("judged")
    check_summary_types(path, content, advice)
    for row in content["cells"]:
        if found := find_impossible_metric(row) or find_impossible_sigma(row.get("sigma_scores", {})):
            raise BadFile(path, found, "possible values", advice)
    if found := find_impossible_statistic([*content["methods"], *content["behaviours"]]):
        raise BadFile(path, found, "possible values", advice)
    return content


def read_cells(out: Path, keys: Collection[str] | None = None) -> Iterator[Cell]:
    """The finished cells of a run or sweep, or those with one of `keys`, in planned order, read one at a time.

    BadFile for a folder that holds no run or a damaged one, at once and not when the first cell is read.
    """
    check_folder(out)
    return _indexed_cells(out, keys)


def _indexed_cells(out: Path, keys: Collection[str] | None) -> Iterator[Cell]:
    with CellIndex(out, read_only=True) as index:
        for row in index.rows():
            if keys is not None and row["key"] not in keys:
                continue
            cell = read_cell(cell_folder(out, row["key"]))
            check_row(index.path, row, as_row(cell))
            yield cell


def write_summary(index: CellIndex, out: Path, statistics: Mapping[str, Any], **facts: Any) -> dict[str, Any]:
    """Write summary.csv (one row per finished cell) and summary.json, whose content is returned.

    summary.json has the given `facts`, outcome, cells_finished, cells_planned, failures (cell -> reason), line_loss
    (see `core.stream_health`; absent where every line let its cell be measured), groups (see
    `table.compute_group_statistics`) and the given `statistics`: those of `compare.run_summary` for a run, none for a
    sweep. The outcome is NOT_COMPARABLE if no cell or, because of its line, not every cell was measured. The index
    then gets the digests of the files and its own.
    """
    counts = index.counts()
    unmeasured = [key for key, value in index.columns("key", "joint_angle_mean_deg") if value is None]
    slow = describe_line_loss(row for row in index.rows_of(unmeasured) if BAUD in row["health"])
    measured = len(unmeasured) < counts.finished and not slow
    outcome = Outcome.PASS if measured else Outcome.NOT_COMPARABLE
    content = {
        **facts,
        "outcome": (outcome if counts.finished == counts.planned else Outcome.INCOMPLETE).word,
        "cells_finished": counts.finished,
        "cells_planned": counts.planned,
        "failures": index.failures(),
        **({"line_loss": slow} if slow else {}),
        "groups": compute_group_statistics(index),
        **statistics,
    }
    write_table(index, out / "summary.csv")
    write_result_json(out / SUMMARY, content)
    index.write_digest(compute_digests(out))
    return content


def remove_leftovers(out: Path) -> None:
    """Remove unfinished files of killed processes; for the process that holds the folder's lock."""
    for path in (*out.glob(f"{TEMPORARY}*"), *(out / "cells").glob(f"{TEMPORARY}*")):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)  # a worker of another computer may still write there
        else:
            path.unlink(missing_ok=True)
