"""Results of one scenario over commits or dates: means of each method and metric, and the changes found in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import numpy as np

from harness.compare.comparability import join_first
from harness.compare.comparison import merge_sampling
from harness.compare.margins import GATED_METRICS, TIME_METRICS, Margin, margin_of
from harness.compare.matching import PAIRING_KEYS, inputs_that_differ, pair_cells
from harness.compare.side_names import name_sides
from harness.compare.timeline.change_points import ChangePoint, MetricSeries, find_changes
from harness.compare.units import Sampling, average_units
from harness.core.arrays import Floats
from harness.core.files import content_key
from harness.errors import BadInput, UnknownName
from harness.results import CellResult, ResultSet, load_results
from harness.results.files import CELLS_FILE, require_kind
from harness.score import DEFINITIONS

ORDERS = ("commit", "date", "given")
TIME_MARGIN = Margin(0.25, 0.01)
"""The least change of a time that counts. Half of a comparison's: several entries stand on each side [choice]."""


@dataclass(frozen=True)
class TimelineEntry:
    """One result."""

    name: str
    where: str
    """Folder, or name of a baseline."""
    commit: str
    """Commit of the package; "" outside a checkout."""
    commit_date: str
    date: str
    """When the run's command was given; "" in results of versions that did not store it."""
    processor: str
    break_why: str = ""
    """Why it cannot be compared with the entry before, so that new series begin; "" if it can."""


@dataclass(frozen=True)
class TimelineSeries:
    """One metric of one method over comparable entries that all have it."""

    method: str
    group: str
    """Inputs and split."""
    metric: str
    unit: str
    entries: tuple[int, ...]
    """(T,) numbers of the entries."""
    means: tuple[float, ...]
    """(T,) means over the units that all entries have."""
    units: int
    changes: tuple[ChangePoint, ...]
    """Their `at` counts within `entries`."""

    def verdict(self, change: ChangePoint) -> str:
        """ "worse" or "better"."""
        return "worse" if (change.difference > 0.0) == margin_of(self.metric).rise_is_worse else "better"

    def percent(self, change: ChangePoint, value: float | None = None) -> float:
        """The difference, or a value in its unit, in per cent of the mean before the change."""
        earlier = max((other.at for other in self.changes if other.at < change.at), default=0)
        before = float(np.mean(self.means[earlier : change.at]))
        return 100.0 * (change.difference if value is None else value) / before if before else float("nan")


@dataclass(frozen=True)
class Timeline:
    """Entries in their order, and the series of all methods and metrics."""

    order: str
    """One of `ORDERS`."""
    entries: tuple[TimelineEntry, ...]
    series: tuple[TimelineSeries, ...]


def build_timeline(
    words: Sequence[str],
    *,
    order: str | None = None,
    methods: Sequence[str] = (),
    metrics: Sequence[str] | None = None,
) -> Timeline:
    """The timeline of runs and baselines, which may have labels (see `name_sides`).

    A folder that is no result stands for the results in it. By default entries are ordered by the dates of their
    commits if all are known and differ, else by the dates of their runs, else as given.

    BadInput for fewer than two results and for an order whose dates are not known; UnknownName for a metric without a
    margin and for a method that no result has.
    """
    metrics = tuple(GATED_METRICS if metrics is None else metrics)
    for metric in metrics:
        margin_of(metric)
    sides = name_sides([folder for word in words for folder in _list_results(word)])
    loaded = [(_entry(name, where, results), results) for name, where in sides for results in [load_results(where)]]
    if len(sides) < 2:
        raise BadInput(f"{', '.join(words)}: {len(sides)} result.", "Name two or more, or a folder that holds them.")
    chosen, loaded = _sort(loaded, order)
    known = dict.fromkeys(cell.method for _, results in loaded for cell in results.cells)
    for method in methods:
        if method not in known:
            raise UnknownName("method of the timeline", method, known)
    entries = [loaded[0][0]]
    for (_, before), (entry, results) in pairwise(loaded):
        entries.append(replace(entry, break_why=_why_not_comparable(before, results, metrics)))
    series = _build_series(entries, [results for _, results in loaded], methods or tuple(known), metrics)
    return Timeline(chosen, tuple(entries), series)


def _list_results(word: str) -> list[str]:
    """The word itself, or the results in the folder that it names."""
    folder = Path(word)
    if not folder.is_dir() or _is_result(folder):
        return [word]
    inside = sorted(str(path) for path in folder.iterdir() if path.is_dir() and _is_result(path))
    if not inside:
        require_kind(folder, "run", "sweep", "baseline")
    return inside


def _is_result(folder: Path) -> bool:
    return (folder / CELLS_FILE).is_file() or (folder / "manifest.json").is_file()


def _entry(name: str, where: str, results: ResultSet) -> TimelineEntry:
    manifest = results.manifest
    commit, processor = (str(manifest.circumstances.get(key) or "") for key in ("commit", "processor"))
    return TimelineEntry(name, where, commit, manifest.commit_date, manifest.date, processor)


def _sort(
    loaded: Sequence[tuple[TimelineEntry, ResultSet]], order: str | None
) -> tuple[str, list[tuple[TimelineEntry, ResultSet]]]:
    dates = {
        "commit": [entry.commit_date for entry, _ in loaded],
        "date": [entry.date for entry, _ in loaded],
    }
    if order is None:
        several = all(dates["commit"]) and len(set(dates["commit"])) > 1
        order = "commit" if several else "date" if all(dates["date"]) else "given"
    if order not in ORDERS:
        raise UnknownName("order", order, ORDERS)
    if order == "given":
        return order, list(loaded)
    missing = [entry.name for (entry, _), date in zip(loaded, dates[order], strict=True) if not date]
    if missing:
        raise BadInput(f"--order {order}: {join_first(missing)} have no such date.", "Use --order given.")
    keys = [
        (datetime.fromisoformat(date), entry.date, at)
        for at, (date, (entry, _)) in enumerate(zip(dates[order], loaded, strict=True))
    ]
    return order, [loaded[at] for *_, at in sorted(keys)]


def _why_not_comparable(before: ResultSet, after: ResultSet, metrics: Sequence[str]) -> str:
    matched = pair_cells(before, after, None, ())
    if not matched.pairs:
        return f"no cell has a partner ({matched.why_none})"
    return join_first(list(inputs_that_differ(matched.pairs, metrics).values()))


def _build_series(
    entries: Sequence[TimelineEntry], results: Sequence[ResultSet], methods: Sequence[str], metrics: Sequence[str]
) -> tuple[TimelineSeries, ...]:
    starts = [0, *(at for at, entry in enumerate(entries) if entry.break_why), len(entries)]
    found, values = list[TimelineSeries](), list[MetricSeries]()
    for start, stop in pairwise(starts):
        cells = [_cells_by_line(each) for each in results[start:stop]]
        sampling = merge_sampling(results[start].manifest, results[stop - 1].manifest)
        for method, group in dict.fromkeys(line for of_entry in cells for line in of_entry if line[0] in methods):
            having = [at for at, of_entry in enumerate(cells) if (method, group) in of_entry]
            for metric in metrics:
                for part in _equal_processors(having, entries[start:stop]) if metric in TIME_METRICS else [having]:
                    table = _unit_values([cells[at][method, group] for at in part], metric, sampling)
                    if table is None or len(part) < 2:
                        continue
                    means = tuple(table.mean(axis=1).tolist())
                    numbers, unit = tuple(start + at for at in part), DEFINITIONS[metric].unit
                    found.append(TimelineSeries(method, group, metric, unit, numbers, means, table.shape[1], ()))
                    is_time = metric in TIME_METRICS
                    values.append(MetricSeries(table, TIME_MARGIN if is_time else margin_of(metric), is_time))
    changes = find_changes(values)
    return tuple(replace(each, changes=tuple(of_it)) for each, of_it in zip(found, changes, strict=True))


_Cells = Mapping[str, CellResult]


def _cells_by_line(results: ResultSet) -> dict[tuple[str, str], dict[str, CellResult]]:
    """(method, inputs and split) -> key of a cell -> the cell."""
    lines: dict[tuple[str, str], dict[str, CellResult]] = {}
    for cell in results.cells:
        key = content_key({name: getattr(cell, name) for name in PAIRING_KEYS})
        lines.setdefault((cell.method, f"{cell.inputs}, {cell.split}"), {})[key] = cell
    return lines


def _equal_processors(having: Sequence[int], entries: Sequence[TimelineEntry]) -> list[list[int]]:
    """The entries in parts of equal processors that follow each other."""
    parts: list[list[int]] = []
    for at in having:
        if parts and entries[parts[-1][-1]].processor == entries[at].processor:
            parts[-1].append(at)
        else:
            parts.append([at])
    return parts


def _unit_values(entries: Sequence[_Cells], metric: str, sampling: Sampling) -> Floats | None:
    """(T, U) values of the units; None where the entries share no cell with this metric."""
    shared = [key for key in entries[0] if all(key in cells for cells in entries)]
    shared = [key for key in shared if all(cells[key].metrics.get(metric) is not None for cells in entries)]
    if not shared:
        return None
    rows = []
    for cells in entries:
        by_clip: dict[str, list[float]] = {}
        for key in shared:
            by_clip.setdefault(cells[key].clip, []).append(float(cells[key].metrics[metric] or 0.0))
        by_unit = average_units({clip: float(np.mean(values)) for clip, values in by_clip.items()}, sampling)
        rows.append(list(by_unit.values()))
    return np.array(rows)
