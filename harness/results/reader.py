"""Results of a run, a sweep or a baseline: cell by cell for comparisons, loaded whole, or selected by name."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.core.ranges import check_words
from harness.core.stream_health import excess_loss
from harness.errors import BadFile, BadInput, MissingExtra, UnknownName
from harness.results.cell import Cell, cell_folder, read_content, row_of_content
from harness.results.files.content_types import find_impossible_metric
from harness.results.files.digests import check_file, check_key, read_result_json
from harness.results.files.folder_kind import BASELINES, CELLS_FILE, require_kind
from harness.results.files.integrity import check_folder, check_row
from harness.results.index import INDEX_FILE, CellIndex
from harness.results.manifest import Manifest, flatten
from harness.results.storage import read_cells
from harness.score import DEFINITIONS

if TYPE_CHECKING:
    from pandas import DataFrame

BASELINE_FILES = ("manifest.json", "summary.json")
"""Files of a baseline whose digests stand in `CELLS_FILE`."""
SCHEMA = 2
"""Version of the format of `CELLS_FILE`; since 2 its files have digests."""
_TEXTS = ("scenario", "clip", "method", "inputs", "split", "noise", "behaviour", "performer")
_IDENTITY = ("scenario", "behaviour", "clip", "performer", "seed", "method", "inputs", "split", "noise")
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
        if folder.exists():
            require_kind(folder, "run", "sweep", "baseline")
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


@dataclass(frozen=True)
class LoadedRun:
    """The results of a run or sweep: a record of each cell, and the arrays of each frame on request."""

    folder: Path
    results: ResultSet
    """Everything that comparisons use: the records, the manifest, the number of planned cells, the failed ones."""

    @property
    def records(self) -> tuple[CellResult, ...]:
        """One record for each finished cell, in the order of the tables: its identity, conditions and metrics."""
        return self.results.cells

    def cells(self, **identity: Any) -> Iterator[Cell]:
        """The finished cells with their arrays over F frames, read from the disk one at a time.

        `identity` chooses cells by equal fields, such as method="ik" or clip="walking_p1_01". BadInput for a field that
        cells do not have.
        """
        for name in identity:
            if name not in Cell.__dataclass_fields__:
                raise BadInput(f"Cells have no field {name!r}.", "Choose by clip, method, inputs, seed or noise.")
        cells = read_cells(self.folder)
        return (cell for cell in cells if all(getattr(cell, name) == value for name, value in identity.items()))

    def to_pandas(self) -> "DataFrame":
        """A table with a row for each record: identity, `vary.KEY` for varied keys, metrics (NaN: not measured).

        MissingExtra when pandas is not installed.
        """
        try:
            from pandas import DataFrame
        except ImportError:
            raise MissingExtra("A table of a run", "pandas", "pandas") from None
        return DataFrame(
            {name: getattr(record, name) for name in _IDENTITY}
            | {f"vary.{key}": value for key, value in record.varied.items()}
            | {name: float("nan") if value is None else value for name, value in record.metrics.items()}
            for record in self.records
        )


def load_run(folder: Path | str) -> LoadedRun:
    """Load the folder of a run or sweep, finished or not; BadFile when it holds none or is damaged."""
    return LoadedRun(Path(folder), load_results(folder))


def select_cells(out: Path, *, clips: Sequence[str] = (), methods: Sequence[str] = ()) -> Iterator[Cell]:
    """The finished cells of a run or sweep whose clip and method are chosen, in planned order, read one at a time.

    `clips` and `methods` are names or patterns, in which `*` stands for any text and `?` for one character; without
    any, all are chosen. A clip without a part ("13_17") stands for all its parts ("13_17@0.20-0.40"). Raises
    UnknownName for an entry that fits no finished cell, BadInput when no cell has a chosen clip and a chosen method,
    and BadFile as `read_cells`.
    """
    check_folder(out)
    with CellIndex(out, read_only=True) as index:
        cells = list(index.columns("key", "clip", "method"))
    _check_entries("clip", clips, [clip for _, clip, _ in cells])
    _check_entries("method", methods, [method for _, _, method in cells])
    keys = {key for key, clip, method in cells if _is_chosen(clip, clips) and _is_chosen(method, methods)}
    if cells and not keys:
        chosen = f"clip {', '.join(clips)} with method {', '.join(methods)}"
        raise BadInput(f"No finished cell of {out} has {chosen}.", "Each occurs, but not together.")
    return read_cells(out, keys)


def _check_entries(kind: str, entries: Sequence[str], names: Sequence[str]) -> None:
    known = tuple(dict.fromkeys(names))
    for entry in entries:
        if not any(_fits(name, entry) for name in known):
            raise UnknownName(kind, entry, known)


def _is_chosen(name: str, entries: Sequence[str]) -> bool:
    return not entries or any(_fits(name, entry) for entry in entries)


def _fits(name: str, entry: str) -> bool:
    """Whether a name fits a pattern; brackets stand for themselves, because they hold the options of a method."""
    pattern = re.escape(entry).replace(r"\*", ".*").replace(r"\?", ".")
    return any(re.fullmatch(pattern, text, re.DOTALL) for text in (name, name.partition("@")[0]))
