"""The table of results for a paper: the mean of each metric with its interval, by condition and method."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from harness.compare import (
    MIN_UNITS,
    ClipValues,
    MethodRanking,
    Sampling,
    average_units,
    count_clips,
    mean_interval,
    rank_methods,
)
from harness.core.number_format import format_number
from harness.errors import UnknownName
from harness.report.figures.conditions import RANKING_METRICS, ConditionSet, RunCondition, read_conditions
from harness.report.kit.ranking import LAG_COLUMN
from harness.results import PRIMARY_METRIC, SECONDARY_METRIC, varied_text
from harness.results.files import find_results, require_kind
from harness.score import DEFINITIONS

Standing = Literal["lowest", "tied", "worse", ""]
"""What the ranking says of a value; "" for a metric that ranks no methods, and without a ranking."""
DEFAULT_METRICS = (PRIMARY_METRIC, SECONDARY_METRIC)


@dataclass(frozen=True)
class MetricValue:
    """One metric of one method in one condition."""

    metric: str
    mean: float | None
    """Mean over the clips on which it was measured, each averaged over its cells first."""
    low: float | None = None
    """Ends of the 95 % interval of the mean; None with fewer than two clips."""
    high: float | None = None
    clips: int = 0
    standing: Standing = ""
    bold: bool = False
    """Whether it is the lowest mean or tied with it, and some other method is worse."""

    def formatted(self) -> tuple[str, str]:
        """The mean, and the interval in brackets: "1.67", "[1.52, 1.83]"; a dash and nothing if not measured."""
        if self.mean is None:
            return "–", ""
        unit = DEFINITIONS[self.metric].unit
        mean = format_number(self.mean, unit)
        if self.low is None or self.high is None:
            return mean, ""
        return mean, f"[{format_number(self.low, unit)}, {format_number(self.high, unit)}]"


@dataclass(frozen=True)
class ResultsRow:
    """One method in one condition."""

    condition: tuple[str, ...]
    """A text for each of `ResultsTable.condition_names`."""
    method: str
    values: tuple[MetricValue, ...]

    @property
    def clips(self) -> int:
        """The largest number of clips behind a value."""
        return max(value.clips for value in self.values)


@dataclass(frozen=True)
class ResultsTable:
    """A table of a run."""

    condition_names: tuple[str, ...]
    """What distinguishes conditions: keys that vary, performers, later frames, behaviour; empty for one condition."""
    metrics: tuple[str, ...]
    rows: tuple[ResultsRow, ...]
    """The rows of a condition follow each other."""
    note: str
    """Sentences that explain the values."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of values."""
        return self.metrics


@dataclass(frozen=True)
class SideBySideTable(ResultsTable):
    """A table of several results: a column for each of them, a row for each metric of a method in a condition."""

    results: tuple[str, ...] = ()
    """Names of the results. The first text of the condition of a row is its metric."""

    @property
    def columns(self) -> tuple[str, ...]:
        return self.results


def build_table(
    folder: Path,
    metrics: Sequence[str] = DEFAULT_METRICS,
    *,
    methods: Sequence[str] = (),
    condition: str = "",
    by_behaviour: bool = False,
) -> ResultsTable:
    """The table of the run or baseline in `folder`; behaviours are pooled unless `by_behaviour`.

    A value is bold by the ranking that the terminal and the page use (`rank_methods`). UnknownName for a metric,
    method or condition that does not exist, BadFile for a folder that holds neither a run nor a baseline or a damaged
    one, NothingMeasured for one without a measured cell.
    """
    for metric in metrics:
        if metric not in DEFINITIONS:
            raise UnknownName("metric", metric, DEFINITIONS)
    require_kind(folder, "run", "baseline")
    run = read_conditions(folder).select(condition, methods)
    names = _condition_names(run, by_behaviour)
    rows, few = [], False
    for each in run.conditions:
        for behaviour in each.behaviours if by_behaviour else (None,):
            values = each.values(behaviour)
            rankings = {m: rank_methods(values, m, each.sampling) for m in metrics if m in RANKING_METRICS}
            few |= any(len(ranking.units) < MIN_UNITS for ranking in rankings.values() if ranking)
            texts = tuple(_condition_text(each, name, behaviour) for name in names)
            rows += [
                ResultsRow(
                    texts,
                    series,
                    tuple(_value(m, values[series], series, rankings, each.sampling) for m in metrics),
                )
                for series in each.series
                if series in values
            ]
    return ResultsTable(names, tuple(metrics), tuple(rows), _note(run, rows, few))


def build_side_by_side_table(
    sides: Sequence[tuple[str, Path | str]],
    metrics: Sequence[str] = DEFAULT_METRICS,
    *,
    methods: Sequence[str] = (),
    condition: str = "",
    by_behaviour: bool = False,
) -> SideBySideTable:
    """The table of several named results, which are folders of runs and baselines, or names of baselines.

    Values are those that the table of each result has, over its own clips. Raises what `build_table` raises.
    """
    tables = [
        build_table(find_results(where), metrics, methods=methods, condition=condition, by_behaviour=by_behaviour)
        for _, where in sides
    ]
    names = tuple(dict.fromkeys(name for table in tables for name in table.condition_names))
    by_key: dict[tuple[tuple[str, ...], str], list[ResultsRow | None]] = {}
    for at, table in enumerate(tables):
        for row in table.rows:
            texts = dict(zip(table.condition_names, row.condition, strict=True))
            key = tuple(texts.get(name, "") for name in names), row.method
            by_key.setdefault(key, [None] * len(tables))[at] = row
    rows = tuple(
        ResultsRow(
            (metric, *texts), method, tuple(row.values[n] if row else MetricValue(metric, None) for row in of_results)
        )
        for n, metric in enumerate(metrics)
        for (texts, method), of_results in by_key.items()
    )
    notes = dict.fromkeys(table.note for table in tables if table.note)
    note = " ".join(["Each result is averaged and ranked on its own clips; harness compare pairs them.", *notes])
    return SideBySideTable(("metric", *names), tuple(metrics), rows, note, tuple(name for name, _ in sides))


def _condition_names(run: ConditionSet, by_behaviour: bool) -> tuple[str, ...]:
    keys = dict.fromkeys(key for each in run.conditions for key in each.setting)
    groups = {each.group for each in run.conditions}
    further = {
        "performers": len({group.performer for group in groups}) > 1,
        LAG_COLUMN: len({group.lag_frames for group in groups}) > 1,
        "behaviour": by_behaviour,
    }
    return (*keys, *(name for name, shown in further.items() if shown))


def _condition_text(condition: RunCondition, name: str, behaviour: str | None) -> str:
    texts = {
        "performers": condition.group.performer,
        LAG_COLUMN: str(condition.group.lag_frames),
        "behaviour": (behaviour or "").replace("_", " "),
    }
    return texts[name] if name in texts else varied_text({name: condition.setting[name]}).removeprefix(f"{name}=")


def _value(
    metric: str,
    values: ClipValues,
    series: str,
    rankings: Mapping[str, MethodRanking | None],
    sampling: Sampling,
) -> MetricValue:
    by_clip = values.get(metric, {})
    if not by_clip:
        return MetricValue(metric, None)
    by_unit = np.array(list(average_units(by_clip, sampling).values()))
    low, high = mean_interval(by_unit) if len(by_unit) > 1 else (None, None)
    ranking = rankings.get(metric)
    standing = _standing(ranking, series) if ranking else ""
    bold = standing in ("lowest", "tied") and ranking is not None and bool(ranking.others("better"))
    return MetricValue(metric, float(by_unit.mean()), low, high, len(by_clip), standing, bold)


def _standing(ranking: MethodRanking, series: str) -> Standing:
    if series == ranking.lowest:
        return "lowest" if ranking.results else ""
    return "worse" if ranking.results[series].verdict == "better" else "tied"


def _note(run: ConditionSet, rows: Sequence[ResultsRow], few: bool) -> str:
    rankings = [(each, ranking) for each in run.conditions if (ranking := each.rank()) is not None]
    counted = dict.fromkeys(count_clips(ranking.clips, each.sampling) for each, ranking in rankings)
    sentences = [f"Mean over units and its 95 % interval: {' or '.join(counted)}."] if counted else []
    if any(value.bold for row in rows for value in row.values):
        sentences.append("Bold: the lowest mean and those tied with it, by the rules of harness compare.")
    if few:
        sentences.append(f"Fewer than {MIN_UNITS} units cannot show a difference, so nothing is bold there.")
    return " ".join(sentences) + run.missing_note
