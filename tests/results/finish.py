"""Finishes a run that a test wrote cell by cell: its index and its summary."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.results import storage
from harness.results.digests import write_result_json
from harness.results.index import CellIndex
from harness.results.manifest import Manifest


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
        return storage.write_summary(index, out, kind="run", orders=())
