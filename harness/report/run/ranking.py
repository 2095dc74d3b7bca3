"""Rankings of the series of a run, from the rows of its summary: sentences, bold cells and charts."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from harness.compare import MARGINS, ClipValues, MethodRanking, Sampling, count_clips, find_best, rank_methods
from harness.core.number_format import format_number
from harness.report.kit.chart import draw_chart
from harness.report.kit.ranking import LAG_NOTE, RankingPanel, describe_ranking, draw_ranking, explain_marks, name_lag
from harness.report.kit.style import Chart
from harness.report.kit.text import metric_name
from harness.report.run.data import Row, RunData, last_varied, series_name
from harness.results import PRIMARY_METRIC, lag_of, setting_text
from harness.score import DEFINITIONS


class RankingGroup(NamedTuple):
    """Series that are ranked together. Known and new performers have different clips; lags are different tasks."""

    performer: str
    lag_frames: int
    """Lag of the methods [frames]."""


GroupedValues = Mapping[RankingGroup, Mapping[str, ClipValues]]
"""Group -> series -> metric -> clip -> mean over its cells; causal methods come first."""
UNRANKED_METRICS = ("jitter_m_s3", "lag_ms")
"""Metrics whose lowest value is not the best: the truth has jitter too, and `lag_ms` has a sign."""
_WIDTH_IN, _MOST_ROWS = 6.4, 14
"""Width of a chart [in]; most methods of a chart, those with the lowest errors."""


def group_values(
    cells: Sequence[Row], methods: Sequence[Row], behaviour: str | None = None, metrics: Iterable[str] = MARGINS
) -> GroupedValues:
    """The values of one behaviour, or of all.

    `cells` are rows of a summary, and `methods` are its methods, which name the series.
    """
    metrics = tuple(metrics)
    collected: dict[RankingGroup, dict[str, dict[str, dict[str, list[float]]]]] = {}
    for row in sorted(cells, key=lag_of):
        if behaviour in (None, row["behaviour"]):
            of_group = collected.setdefault(RankingGroup(row["performer"], lag_of(row)), {})
            of_series = of_group.setdefault(series_name(row, methods), {})
            for metric in metrics:
                if row.get(metric) is not None:
                    of_series.setdefault(metric, {}).setdefault(row["clip"], []).append(float(row[metric]))
    return {
        group: {
            series: {
                metric: {clip: float(np.mean(values)) for clip, values in by_clip.items()}
                for metric, by_clip in by_metric.items()
            }
            for series, by_metric in of_group.items()
        }
        for group, of_group in collected.items()
    }


def best_series(values: GroupedValues, metric: str, sampling: Sampling) -> set[str]:
    """The series that is better than every other one by a metric, for each group that has one."""
    if metric in UNRANKED_METRICS or metric not in MARGINS:
        return set()
    return {best for of_group in values.values() if (best := find_best(of_group, metric, sampling))}


def rank_groups(summary: Mapping[str, Any]) -> Mapping[RankingGroup, MethodRanking | None]:
    """Group -> its ranking by the primary metric, None where its methods share no clip.

    Where the scenario varies keys, the last combination of values counts.
    """
    sampling = Sampling.of_summary(summary)
    return {group: rank_methods(of, PRIMARY_METRIC, sampling) for group, of in _measured_groups(summary).items()}


def _measured_groups(summary: Mapping[str, Any]) -> GroupedValues:
    """The values of the last setting, of the series that have the primary metric."""
    groups = group_values(last_varied(summary)["cells"], summary["methods"])
    return {
        group: {name: of for name, of in values.items() if of.get(PRIMARY_METRIC)} for group, values in groups.items()
    }


def describe_rankings(summary: Mapping[str, Any], motion: str) -> list[tuple[str, str | None]]:
    """For each group a description, and the series with the lowest error.

    Where the scenario varies keys, the last combination of values counts. `motion` names the motion.
    """
    last = last_varied(summary)
    groups = _measured_groups(summary)
    several, found = len({group.performer for group in groups}) > 1, list[tuple[str, str | None]]()
    setting = setting_text(last["cells"][0]) if last["cells"] else ""
    for group, ranking in rank_groups(summary).items():
        measured = groups[group]
        if ranking is None:
            if measured:
                found.append((f"{', '.join(measured)} share no measured sequence, so they are not ranked.", None))
            continue
        sequences = count_clips(ranking.clips, Sampling.of_summary(summary), "sequence")
        if len(ranking.clips) < max(len(of[PRIMARY_METRIC]) for of in measured.values()):
            sequences = f"the {sequences} that all methods were measured on"
        where = f"{sequences} of {motion}" + (
            f" by {group.performer} performers" if several and group.performer else ""
        )
        where += f", with {setting}" if setting else ""
        where += f", with {name_lag(group.lag_frames)}" if group.lag_frames else ""
        text = describe_ranking(ranking, where, lambda error: f"{error:.2f}°")
        found.append((text, ranking.lowest))
    if len({group.lag_frames for group in groups}) > 1:
        found.append((LAG_NOTE, None))
    return found


def ranking_charts(run: RunData) -> list[Chart]:
    """A chart for each group of methods that share a clip, in the order of the headline's sentences."""
    rankings = [(group, ranking) for group, ranking in rank_groups(run.full_summary).items() if ranking]
    several = len({group.performer for group, _ in rankings}) > 1
    return [
        _ranking_chart(n, _chart_title(group, several), ranking) for n, (group, ranking) in enumerate(rankings, start=1)
    ]


def _chart_title(group: RankingGroup, several: bool) -> str:
    parts = [f"{group.performer} performers"] if several and group.performer else []
    return ", ".join([*parts, *([name_lag(group.lag_frames)] if group.lag_frames else [])])


def _ranking_chart(number: int, title: str, ranking: MethodRanking) -> Chart:
    names, unit = list(ranking.values), DEFINITIONS[PRIMARY_METRIC].unit
    shown = replace(ranking, values={name: ranking.values[name] for name in names[:_MOST_ROWS]})
    panel = RankingPanel(title, shown)
    more = f" The {len(shown.values)} of {len(names)} methods with the lowest means." if len(names) > _MOST_ROWS else ""
    means = ", ".join(f"{name} {format_number(mean, unit)}" for name, mean in shown.means.items())
    return draw_chart(
        f"ranking_{number}",
        "Ranking" + (f": {title}" if title else ""),
        f"Mean {metric_name(PRIMARY_METRIC)}. {explain_marks([panel])}{more}",
        f"Mean {metric_name(PRIMARY_METRIC)} [{unit}] of each method: {means}.",
        lambda figure: draw_ranking(figure, [panel], metric_name(PRIMARY_METRIC), unit),
        3.0,
        width_in=_WIDTH_IN,
    )
