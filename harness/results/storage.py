"""The folder of a run: manifest.json, summary.json, summary.csv and atomic cells.

Presence of a cell means that it is finished; the same run again goes on where it was. A cell's key holds its inputs,
the method and the source of both, so edited code never meets stale results.
"""

import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.core.files import TEMPORARY, content_key, digest, read_json, write_json, write_text
from harness.errors import BadFile, BadInput, Outcome
from harness.results.cell import Cell, as_row, cell_folder, has_cell, read_cell, write_cell
from harness.results.expected_orders import ExpectedOrder, evaluate_orders
from harness.results.manifest import Manifest
from harness.results.recovery import RecoveryCollector
from harness.results.summary import GROUP_KEYS, SummaryStatistics, as_csv

__all__ = [
    "Cell",
    "cell_key",
    "digest",
    "has_cell",
    "open_run",
    "read_cell",
    "read_cells",
    "read_summary",
    "summary_rows",
    "write_cell",
    "write_summary",
]


_SUMMARY_KEYS = ("outcome", "cells_finished", "cells_planned", "failures", "methods", "behaviours", "cells")


def cell_key(inputs: Mapping[str, Any], method: Mapping[str, Any], source_hash: str) -> str:
    """Name of a cell: a hash of all that defines it, so that equal keys mean equal results."""
    return content_key({"inputs": inputs, "method": method, "source": source_hash})


def open_run(out: Path, manifest: Manifest) -> None:
    """Make the folder of a run, or go on with it; BadInput when it holds another run or other files.

    Leftovers of a killed run are cleared away.
    """
    advice = "Name another folder with --out, or delete this one."
    if out.exists() and not out.is_dir():
        raise BadInput(f"{out} is a file.", "Name a folder with --out.")
    held = {path.name for path in out.iterdir() if not path.name.startswith(TEMPORARY)} if out.is_dir() else set()
    if "manifest.json" in held:
        found = Manifest.read(out / "manifest.json")
        if differences := manifest.differences(found):
            raise BadInput(f"{out} holds another run (differs in {', '.join(differences)}).", advice)
    elif held:
        raise BadInput(f"{out} holds files that are no run ({', '.join(sorted(held)[:3])}).", advice)
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_json(out / "manifest.json", manifest.as_dict())  # first: without it a folder is no run
        (out / "cells").mkdir(exist_ok=True)
        _remove_leftovers(out)
    except OSError as error:
        raise BadInput(f"{out} cannot be written ({error.strerror}).", "Name another folder with --out.") from error


def read_summary(out: Path) -> dict[str, Any]:
    """What `write_summary` wrote; BadFile when it is none, or names cells that are no folder of the run."""
    path, expected = out / "summary.json", "the summary of a run"
    content = read_json(path, expected)
    advice = "Give the command of the run again."
    if missing := [name for name in _SUMMARY_KEYS if name not in content]:
        raise BadFile(path, f"no {', '.join(missing)}", expected, advice)
    for row in content["cells"]:
        if not re.fullmatch(r"\w+", str(row.get("key"))):
            raise BadFile(path, f"a cell called {row.get('key')!r}", "names of folders in cells/", advice)
    return content


def read_cells(out: Path) -> Iterator[Cell]:
    """The cells that the run's summary lists, one at a time; all finished ones while there is no summary yet.

    Refuses a folder that holds no run at once (BadFile), not when the first cell is asked for.
    """
    if (out / "summary.json").is_file():
        keys = [str(row["key"]) for row in read_summary(out)["cells"]]
    else:
        Manifest.read(out / "manifest.json")
        keys = sorted(path.name for path in (out / "cells").glob("*") if not path.name.startswith(TEMPORARY))
    return (read_cell(cell_folder(out, key)) for key in keys)


def summary_rows(cells: Iterable[Cell]) -> list[dict[str, Any]]:
    """A row for each cell: identity, then every metric (None: not measured)."""
    return [as_row(cell) for cell in cells]


def write_summary(
    out: Path,
    *,
    keys: Iterable[str],
    planned: int,
    failures: Mapping[str, str] | None = None,
    orders: Sequence[ExpectedOrder] = (),
) -> dict[str, Any]:
    """Write summary.csv (a row for each cell) and summary.json, whose content is returned.

    `keys` are the finished cells in the order of the table, `failures` cell -> what went wrong. summary.json has
    outcome, cells_finished, cells_planned, failures, cells (rows), methods and behaviours (see `SummaryStatistics.rows`), recovery
    (see `recovery.Recoveries`), which is empty unless the scenario varies a disturbance, and orders (see
    `orders.judged`), empty unless it expects any.
    """
    failures = dict(failures or {})
    methods, behaviours, recoveries = (
        SummaryStatistics(*GROUP_KEYS),
        SummaryStatistics(*GROUP_KEYS, "behaviour"),
        RecoveryCollector(),
    )
    rows = []
    for key in keys:
        cell = read_cell(cell_folder(out, key))
        rows.append(as_row(cell))
        methods.add(cell)
        behaviours.add(cell)
        recoveries.add(cell)
    whole = len(rows) == planned and not failures
    content = {
        "outcome": (Outcome.PASS if whole else Outcome.INCOMPLETE).word,
        "cells_finished": len(rows),
        "cells_planned": planned,
        "failures": failures,
        "methods": methods.rows(),
        "behaviours": behaviours.rows(),
        "recovery": recoveries.rows(),
        "expected_orders": evaluate_orders(orders, rows),
        "cells": rows,
    }
    write_text(out / "summary.csv", as_csv(rows))
    write_json(out / "summary.json", content)
    return content


def _remove_leftovers(out: Path) -> None:
    for folder in (out, out / "cells"):
        for path in folder.glob(f"{TEMPORARY}*"):
            if _writer_is_alive(path):
                continue
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()


def _writer_is_alive(path: Path) -> bool:
    """Whether the process whose number is in the name lives: another run of the same scenario into the same folder."""
    number = path.name.removeprefix(TEMPORARY).partition("-")[0]
    if not number.isdigit() or int(number) == os.getpid():
        return False
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
