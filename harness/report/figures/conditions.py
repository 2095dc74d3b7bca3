"""The conditions of a run with the methods that may be ranked together, and their errors over time, for figures."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from harness.compare import MARGINS, ClipValues, MethodRanking, Sampling, rank_methods
from harness.errors import BadFile, BadInput, NothingMeasured, UnknownName
from harness.report.figures.print_figure import FigureSelection
from harness.report.kit.error_lines import CONTROL, Highlights, choose_highlights, find_series
from harness.report.kit.ranking import name_lag
from harness.report.kit.text import list_first
from harness.report.run.data import Row, RunData, Trace, last_varied, read_traces, series_name
from harness.report.run.ranking import UNRANKED_METRICS, RankingGroup, group_values
from harness.results import PRIMARY_METRIC, Manifest, lag_of, load_results, read_summary, varied_text
from harness.results.files import CELLS_FILE, check_cells, check_folder, read_summary_json
from harness.score import DEFINITIONS

_MOST_NAMED = 6
RANKING_METRICS = tuple(
    name for name, margin in MARGINS.items() if margin.rise_is_worse and name not in UNRANKED_METRICS
)
"""Metrics that rank methods: a lower value is better, and a margin says which difference matters."""


@dataclass(frozen=True, eq=False)
class RunCondition:
    """One combination of varied values, known or new performers, and one number of later
    frames: its cells are ranked together."""

    setting: Mapping[str, Any]
    group: RankingGroup
    parts: tuple[str, ...]
    """Texts of what distinguishes it from the other conditions of the run; empty if it is the only one."""
    cells: tuple[Row, ...]
    """Rows of the summary."""
    methods: tuple[Row, ...]
    """Rows of the summary's methods, which name the series."""
    sampling: Sampling
    """What is a unit of statistics."""

    @property
    def name(self) -> str:
        """Name, such as "noise=clean, new performers"; empty if the run has only one condition."""
        return ", ".join(self.parts)

    @property
    def series(self) -> tuple[str, ...]:
        """Names of what is compared: methods, qualified by inputs and split where these vary, in the run's order."""
        return tuple(dict.fromkeys(map(self.series_of, self.cells)))

    @property
    def behaviours(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(str(row["behaviour"]) for row in self.cells))

    @property
    def clips(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(str(row["clip"]) for row in self.cells))

    def series_of(self, row: Row) -> str:
        """The series that the row of a cell belongs to."""
        return series_name(row, self.methods)

    def values(self, behaviour: str | None = None) -> Mapping[str, ClipValues]:
        """Series -> metric -> clip -> mean over its cells, of one behaviour or of all."""
        groups = group_values(self.cells, self.methods, behaviour, DEFINITIONS)
        return groups.get(self.group, {})

    def rank(self, metric: str = PRIMARY_METRIC, behaviour: str | None = None) -> MethodRanking | None:
        """The ranking by one of RANKING_METRICS; None when the series share no clip."""
        return rank_methods(self.values(behaviour), metric, self.sampling)


@dataclass(frozen=True, eq=False)
class ConditionSet:
    """The conditions of a run, and how much of it was measured."""

    folder: Path
    conditions: tuple[RunCondition, ...]
    finished: int
    planned: int

    def select(self, condition: str = "", methods: Sequence[str] = ()) -> "ConditionSet":
        """The conditions that have all parts of a name such as "noise=clean", with these methods, in their order.

        Without a name or without methods, all of them. UnknownName for a condition or method that the run lacks.
        """
        chosen = self.conditions
        if condition:
            parts = {part.strip() for part in condition.split(",")}
            chosen = tuple(each for each in chosen if parts <= set(each.parts))
            if not chosen:
                known = dict.fromkeys(part for each in self.conditions for part in each.parts)
                raise UnknownName("condition of the run", condition, known)
        if methods:
            chosen = _select_methods(chosen, methods)
        return replace(self, conditions=chosen)

    @property
    def missing_note(self) -> str:
        """Sentence of a caption about cells that were not measured; empty without such cells."""
        missing = self.planned - self.finished
        return f" {missing:,} of {self.planned:,} planned cells were not measured." if missing else ""


def read_conditions(folder: Path) -> ConditionSet:
    """Read the conditions of the run or baseline in a folder, in the order of its cells.

    BadFile when it holds no finished run or a damaged one, NothingMeasured when no cell has a joint-angle error.
    """
    summary = _baseline_summary(folder) if (folder / CELLS_FILE).exists() else _run_summary(folder)
    cells: Sequence[Row] = summary["cells"]
    if all(row[PRIMARY_METRIC] is None for row in cells):
        raise NothingMeasured(folder, len(summary["failures"]))
    keys = list[tuple[Mapping[str, Any], RankingGroup]]()
    for row in cells:
        if (key := (row["varied"], _group_of(row))) not in keys:
            keys.append(key)
    groups = {group for _, group in keys}
    several = [len({getattr(group, name) for group in groups}) > 1 for name in RankingGroup._fields]
    keys.sort(key=lambda key: key[1].lag_frames)
    conditions = (_condition(*key, several, summary) for key in keys)
    return ConditionSet(folder, tuple(conditions), summary["cells_finished"], summary["cells_planned"])


def _run_summary(folder: Path) -> dict[str, Any]:
    check_folder(folder)
    summary = read_summary(folder)
    check_cells(folder, summary["cells"])
    return summary


def _baseline_summary(folder: Path) -> dict[str, Any]:
    """The summary of the run that a baseline was saved from, with the metrics that a baseline keeps."""
    results = load_results(folder)
    summary = read_summary_json(folder)
    if "methods" not in summary:
        raise BadFile(folder, "a baseline of a sweep", "a baseline of a run", "`harness compare` reads it.")
    missing = dict.fromkeys(DEFINITIONS)
    cells = [
        {**missing, **vars(cell), **cell.metrics, "lag": lag_of(cell.defined_by), "key": at}
        for at, cell in enumerate(results.cells)
    ]
    return {**summary, **vars(results.manifest), "cells": cells, "failures": {}}


def _condition(
    varied: Mapping[str, Any], group: RankingGroup, several: Sequence[bool], summary: Mapping[str, Any]
) -> RunCondition:
    several_performers, several_lags = several
    performers = f"{group.performer} performers" if several_performers and group.performer else ""
    later = name_lag(group.lag_frames) if several_lags else ""
    return RunCondition(
        varied,
        group,
        tuple(part for part in (varied_text(varied), performers, later) if part),
        tuple(row for row in summary["cells"] if (row["varied"], _group_of(row)) == (varied, group)),
        tuple(row for row in summary["methods"] if row["performer"] == group.performer),
        Sampling.of_summary(summary),
    )


def _group_of(row: Row) -> RankingGroup:
    return RankingGroup(row["performer"], lag_of(row))


def _select_methods(conditions: Sequence[RunCondition], names: Sequence[str]) -> tuple[RunCondition, ...]:
    """The conditions with the cells of some methods, named as the method or as the series, in the order of the names.

    A condition without any of them is left out.
    """
    known = dict.fromkeys(str(row["method"]) for each in conditions for row in each.cells)
    known |= dict.fromkeys(name for each in conditions for name in each.series)
    for name in names:
        if name not in known:
            raise UnknownName("method of the run", name, known)
    selected = []
    for each in conditions:
        cells = [row for name in names for row in each.cells if name in (row["method"], each.series_of(row))]
        if cells:
            selected.append(replace(each, cells=tuple({row["key"]: row for row in cells}.values())))
    return tuple(selected)


def describe_absent(series: Iterable[str], shown: Iterable[str]) -> str:
    """Sentence of a caption on the series that a figure cannot show; empty if it shows all of them."""
    absent = sorted(set(series) - set(shown))
    return f" Not measured: {list_first(absent, _MOST_NAMED)}." if absent else ""


def check_metric(metric: str, known: Iterable[str], kind: str) -> None:
    """UnknownName when a metric does not exist, BadInput when it exists but is none of the known ones."""
    known = tuple(known)
    if metric not in DEFINITIONS:
        raise UnknownName("metric", metric, known)
    if metric not in known:
        raise BadInput(f"{metric} is no {kind}.", f"Choose one of {', '.join(known)}.")


def choose_condition(run: ConditionSet, selection: FigureSelection) -> RunCondition:
    """The condition of a figure that shows one: the last varied values, causal methods, known performers.

    It has the chosen clip, if any. UnknownName for a clip that no condition has.
    """
    chosen = run.conditions
    if selection.clip:
        chosen = tuple(each for each in chosen if selection.clip in each.clips)
        if not chosen:
            clips = dict.fromkeys(clip for each in run.conditions for clip in each.clips)
            raise UnknownName("clip of the run", selection.clip, clips)
    last = chosen[-1].setting
    return next(each for each in chosen if each.setting == last and each.group.lag_frames == chosen[0].group.lag_frames)


def rank_highlights(condition: RunCondition, selection: FigureSelection) -> Highlights:
    """The series with the lowest mean joint angle error, and the control.

    UnknownName for a control that the condition lacks, BadInput when the methods share no clip.
    """
    ranking: MethodRanking | None = condition.rank()
    if ranking is None:
        raise BadInput("The methods share no measured clip.", "Choose methods with --methods.")
    leader, *others = ranking.values
    if selection.control and not find_series(others, selection.control):
        raise UnknownName("control among the methods shown", selection.control, others)
    return choose_highlights([leader, *others], selection.control or CONTROL)


def read_series(
    folder: Path, condition: RunCondition, keep: Callable[[str, Row], bool]
) -> Mapping[str, Sequence[Trace]]:
    """Series -> traces of the cells of a condition that `keep` accepts by series and row; in the condition's order.

    BadFile for a damaged cell.
    """
    summary = read_summary(folder)
    run = RunData(folder, Manifest.read(folder / "manifest.json"), last_varied(summary), (), summary)
    rows = [row for row in condition.cells if keep(condition.series_of(row), row)]
    found: dict[str, list[Trace]] = {}
    for row, trace in zip(rows, read_traces(run, rows), strict=True):
        found.setdefault(condition.series_of(row), []).append(trace)
    return found
