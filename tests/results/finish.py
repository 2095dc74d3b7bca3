"""Makes the folder of a run, and finishes one that a test wrote cell by cell: its index and its summary."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.compare.run_summary import compute_run_statistics
from harness.results import storage
from harness.results.files.digests import write_result_json
from harness.results.files.folder_kind import LOCK_FILE
from harness.results.index import CellIndex
from harness.results.manifest import Manifest


def make_run(out: Path, manifest: Manifest) -> None:
    """Make or open the folder of a run as a command does, and release it at once."""
    with storage.open_run(out, manifest):
        pass


def folder_bytes(out: Path) -> dict[str, bytes]:
    """Content of every file below a folder but the lock, by its path there."""
    files = (path for path in out.rglob("*") if path.is_file() and path.name != LOCK_FILE)
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


def write_run(
    out: Path, cells: Sequence[storage.Cell], *, planned: int | None = None, failures: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Write these cells and finish their run; the summary's content. By default nothing else was planned."""
    for cell in cells:
        storage.write_cell(out, cell)
    every = len(cells) + len(failures or {}) if planned is None else planned
    return finish_run(out, keys=[cell.key for cell in cells], planned=every, failures=failures)


def finish_run(
    out: Path, *, keys: Sequence[str], planned: int, failures: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Plan the finished cells `keys`, the failed ones, and unnamed others up to `planned`; the summary's content.

    A run without a manifest gets one that names no input.
    """
    if not (out / "manifest.json").is_file():
        write_result_json(out / "manifest.json", Manifest({}, {}, {}).as_dict())
    failures = dict(failures or {})
    others = [f"planned {n}" for n in range(planned - len(keys) - len(failures))]
    with CellIndex(out) as index:
        index.plan([*keys, *failures, *others])
        index.add_from_folders()
        index.record_outcomes([(key, key, "") for key in keys])
        index.record_outcomes([(cell, "", text) for cell, text in failures.items()])
        index.note(kind="run")
        return storage.write_summary(index, out, compute_run_statistics(index, out, (), {}), kind="run")
