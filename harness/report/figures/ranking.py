"""The figure `ranking`: mean error of each method and its paired difference to the lowest, one panel a condition."""

from harness.compare.units import count_clips
from harness.core.number_format import count_noun
from harness.errors import BadInput
from harness.report.figures.conditions import RANKING_METRICS, ConditionSet, RunCondition, check_metric, describe_absent
from harness.report.figures.selection import FigureSelection
from harness.report.kit.metric_labels import metric_name
from harness.report.kit.print_figure import PrintFigure
from harness.report.kit.ranking_chart import RankingPanel, draw_ranking, explain_marks
from harness.results.reported_metrics import PRIMARY_METRIC
from harness.score.metrics import DEFINITIONS

_HEIGHT_MM = 60.0
"""Height before the rows are counted."""


def ranking_figure(run: ConditionSet, selection: FigureSelection) -> PrintFigure:
    """The ranking of every selected condition, by the statistics of `harness compare`."""
    metric = selection.metric
    check_metric(metric, RANKING_METRICS, "metric that ranks methods")
    ranked = [(each, ranking) for each in run.conditions if (ranking := each.rank(metric))]
    panels = [RankingPanel(each.name, ranking) for each, ranking in ranked]
    if not panels:
        raise BadInput(f"No clip of {run.folder} has {metric} of every method.", "Choose methods with --methods.")
    unit = DEFINITIONS[metric].unit
    return PrintFigure(
        "ranking" if metric == PRIMARY_METRIC else f"ranking_{metric}",
        _caption(run, metric, [each for each, _ in ranked], panels),
        lambda figure: draw_ranking(figure, panels, metric_name(metric), unit),
        _HEIGHT_MM,
    )


def _caption(run: ConditionSet, metric: str, shown: list[RunCondition], panels: list[RankingPanel]) -> str:
    counts = list(
        dict.fromkeys(count_clips(panel.ranking.clips, of.sampling) for of, panel in zip(shown, panels, strict=True))
    )
    fewer = any(len(panel.ranking.clips) < len(each.clips) for each, panel in zip(shown, panels, strict=True))
    clips = " and ".join(counts) + (" that all methods were measured on" if fewer else "")
    sentences = [f"Mean {metric_name(metric)} on {clips}.", explain_marks(panels)]
    unranked = len(run.conditions) - len(panels)
    sentences += [f"In {count_noun(unranked, 'condition')} the methods share no clip."] if unranked else []
    expected = (name for each in shown for name in each.series)
    absent = describe_absent(expected, (name for panel in panels for name in panel.ranking.values))
    return " ".join(sentences) + absent + run.missing_note
