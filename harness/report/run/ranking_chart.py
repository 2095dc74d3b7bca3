"""The charts of a run that rank its methods: one for each group of methods that are ranked together."""

from dataclasses import replace

from harness.compare.ranking import MethodRanking
from harness.core.number_format import format_number
from harness.report.kit.chart import draw_chart
from harness.report.kit.metric_labels import metric_name
from harness.report.kit.ranking import name_lag
from harness.report.kit.ranking_chart import RankingPanel, draw_ranking, explain_marks
from harness.report.kit.style import Chart
from harness.report.run.data import RunData
from harness.report.run.ranking import RankingGroup, rank_groups
from harness.results.reported_metrics import PRIMARY_METRIC
from harness.score.metrics import DEFINITIONS

_WIDTH_IN, _MOST_ROWS = 6.4, 14
"""Width of a chart [in]; most methods of a chart, those with the lowest errors."""


def ranking_charts(run: RunData) -> list[Chart]:
    """A chart for each group of methods that share a clip, in the order of the headline's sentences."""
    rankings = [(group, ranking) for group, ranking in rank_groups(run.full_summary).items() if ranking]
    several = len({group.performer for group, _ in rankings}) > 1
    return [_chart(n, _title(group, several), ranking) for n, (group, ranking) in enumerate(rankings, start=1)]


def _title(group: RankingGroup, several: bool) -> str:
    parts = [f"{group.performer} performers"] if several and group.performer else []
    return ", ".join([*parts, *([name_lag(group.lag)] if group.lag else [])])


def _chart(number: int, title: str, ranking: MethodRanking) -> Chart:
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
