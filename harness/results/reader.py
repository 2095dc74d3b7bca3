"""Results of a run, a sweep or a baseline, cell by cell, as comparisons use them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from harness.core.ranges import check_words
from harness.core.stream_health import excess_loss
from harness.errors import BadFile, UnknownName
from harness.results.cell import cell_folder, read_content, row_of_content
from harness.results.digests import check_file, check_key, read_result_json
from harness.results.folder_kind import CELLS_FILE
from harness.results.index import INDEX_FILE, CellIndex
from harness.results.integrity import check_folder, check_row
from harness.results.manifest import Manifest, flatten
from harness.results.plausibility import find_impossible_metric
from harness.score.metrics import DEFINITIONS

BASELINES = Path("results/baselines")
BASELINE_FILES = ("manifest.json", "summary.json")
"""Files of a baseline whose digests stand in `CELLS_FILE`."""
SCHEMA = 2
"""Version of the format of `CELLS_FILE`; since 2 its files have digests."""
_TEXTS = ("scenario", "clip", "method", "inputs", "split", "noise", "behaviour", "performer")
_KINDS = {**dict.fromkeys(_TEXTS, str), "seed": int, **dict.fromkeys(("varied", "defined_by", "metrics"), dict)}
COUNT_METRICS = ("frames_matched", "frames_expected")
_ADVICE = "Run, or save, it again."
_BASELINE_ADVICE = "Restore it from version control, or save the baseline again with this version of the harness."


@dataclass(frozen=True)
class CellResult:
    """Result of one cell: its identity, its conditions and its metrics."""

    scenario: str
    clip: str
    seed: int
    method: str
    inputs: str
    split: str
    noise: str
    varied: Mapping[str, Any]
    """Scenario key -> value, of the keys that the scenario varies."""
    behaviour: str
    performer: str
    """ "known", "new", or "" without examples (see `cell.Cell`)."""
    defined_by: Mapping[str, Any]
    """Everything that two results must agree on to be comparable."""
    metrics: Mapping[str, float | None]
    """By name; None is "not measured"."""
    line_loss: float = 0.0
    """Share of the records that the line dropped beyond what the scenario allows, 0 in a baseline (see
    `core.stream_health.excess_loss`)."""


@dataclass(frozen=True)
class ResultSet:
    """All results of one side of a comparison."""

    title: str
    """Name for readers, such as "results/demo" or "baseline gate"."""
    manifest: Manifest
    cells: tuple[CellResult, ...]
    """The finished cells in the order of their table."""
    planned: int
    failed: tuple[str, ...] = ()
    """Names of planned cells that failed."""


def load_results(where: Path | str) -> ResultSet:
    """Load the folder of a run, sweep or baseline, or the baseline of that name below `BASELINES`.

    A folder takes precedence over a name. BadFile for any other folder and for one that is damaged, edited or was
    written by another version; UnknownName for an unknown name.
    """
    folder = Path(where)
    check_words(folder)
    if not folder.is_dir():
        known = sorted(path.parent.name for path in BASELINES.glob(f"*/{CELLS_FILE}"))
        if folder.name != str(where):
            raise BadFile(folder, "no such folder", "a run, a sweep or a baseline", "`harness run` writes one.")
        if str(where) not in known:
            raise UnknownName("folder or baseline", str(where), known)
        return _load_baseline(BASELINES / folder, str(where))
    if (folder / CELLS_FILE).exists():
        return _load_baseline(folder)
    check_folder(folder)
    manifest = Manifest.read(folder / "manifest.json")
    with CellIndex(folder, read_only=True) as index:
        cells = tuple(_cell_from_row(folder, row) for row in index.rows())
        return ResultSet(str(where), manifest, cells, index.counts().planned, tuple(index.failures()))


def _cell_from_row(folder: Path, row: Mapping[str, Any]) -> CellResult:
    if not row.get("scenario"):
        advice = "An older version wrote it: run again with another --out."
        raise BadFile(folder, "cells that name no scenario", "a run of this version of the harness", advice)
    path = cell_folder(folder, row["key"]) / "cell.json"
    content = read_content(path.parent)
    check_row(folder / INDEX_FILE, row, row_of_content(path.parent, content))
    metrics, defined_by = {name: row.get(name) for name in DEFINITIONS if name in row}, content.get("defined_by")
    cell = _check_cell(path, {**row, "defined_by": defined_by, "metrics": metrics})
    allowed = bool(flatten(cell.defined_by).get("tracker.overload", False))
    return replace(cell, line_loss=excess_loss(row["health"], allowed=allowed))


def _load_baseline(folder: Path, name: str | None = None) -> ResultSet:
    """The baseline in a folder. BadFile when it is damaged, or not the one that was asked for by `name`.

    Versions before did not store the name.
    """
    path, expected = folder / CELLS_FILE, "the cells of a baseline"
    content = read_result_json(path, expected, _BASELINE_ADVICE)
    if content.get("schema") != SCHEMA:
        raise BadFile(path, f"schema {content.get('schema')}", f"schema {SCHEMA}", _BASELINE_ADVICE)
    stored = content.get("name", name or folder.name)
    check_key(path, stored, name or stored, expected, _BASELINE_ADVICE)
    try:
        for file in BASELINE_FILES:
            check_file(folder / file, content["digests"][file], f"the {file} that {CELLS_FILE} names", _BASELINE_ADVICE)
        shared, parts, planned = content["shared"], content["parts"], int(content["planned"])
        names, complete = content["metrics"], []
        for cell in content["cells"]:
            metrics = dict(zip(names, cell["metrics"], strict=True))
            complete.append({**cell, "metrics": metrics, "defined_by": {**shared, **parts[cell["part"]]}})
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise BadFile(path, f"damaged ({error!r})", expected, _ADVICE) from error
    cells = tuple(_check_cell(path, cell) for cell in complete)
    if planned != len(cells):
        raise BadFile(path, f"{len(cells)} cells of {planned}", expected, _ADVICE)
    return ResultSet(f"baseline {stored}", Manifest.read(folder / "manifest.json"), cells, planned)


def _check_cell(path: Path, content: Mapping[str, Any]) -> CellResult:
    """The result of a cell; BadFile when a value is missing or has another type."""
    for name, kind in _KINDS.items():
        if not isinstance(content.get(name), kind):
            raise BadFile(path, f"{name} is {content.get(name)!r}", f"a cell with a {kind.__name__} there", _ADVICE)
    for name in (*COUNT_METRICS, *content["metrics"]):
        value = content["metrics"].get(name)
        if not (isinstance(value, int | float) and math.isfinite(value)) and (
            value is not None or name in COUNT_METRICS
        ):
            raise BadFile(path, f"{name} is {value!r}", "a cell with a number there", _ADVICE)
    if found := find_impossible_metric(content["metrics"]):
        raise BadFile(path, found, "possible values", _ADVICE)
    return CellResult(**{name: content[name] for name in _KINDS})
