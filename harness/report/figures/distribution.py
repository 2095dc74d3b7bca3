"""The figure `cdf`: cumulative distribution of the errors of single frames, a curve for each method."""

from typing import TYPE_CHECKING

import numpy as np

from harness.core.number_format import count_noun
from harness.errors import BadInput
from harness.report.figures.conditions import ConditionSet, check_metric, describe_absent
from harness.report.figures.selection import FigureSelection
from harness.report.figures.traces import choose_condition, read_series
from harness.report.kit.chart import add_legend
from harness.report.kit.distribution_chart import draw_distribution
from harness.report.kit.metric_labels import metric_label, metric_name
from harness.report.kit.print_figure import PrintFigure
from harness.report.kit.style import print_line_style
from harness.report.run.data import WORST_METRICS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEIGHT_MM = 60.0


def distribution_figure(run: ConditionSet, selection: FigureSelection) -> PrintFigure:
    """Distribution of the errors of all scored frames of one condition, or of one clip of it."""
    metric = selection.metric
    check_metric(metric, WORST_METRICS, "metric of single frames that is drawn")
    condition = choose_condition(run, selection)
    traces = read_series(run.folder, condition, lambda _, row: selection.clip in ("", row["clip"]))
    values = {name: np.concatenate([t.errors[metric][t.scored] for t in of]) for name, of in traces.items()}
    measured = {name: of for name, of in values.items() if np.isfinite(of).any()}
    if not measured:
        raise BadInput(f"No frame of {run.folder} has {metric}.", "Choose another metric or clip.")
    clips = selection.clip or count_noun(len(condition.clips), "clip")
    where = f"{clips}, {condition.name}" if condition.name else clips
    frames = max(int(np.isfinite(of).sum()) for of in measured.values())

    def draw(figure: "Figure") -> None:
        axes = figure.subplots()
        styles = {name: print_line_style(n) for n, name in enumerate(measured)}
        draw_distribution(axes, measured, metric_label(metric), styles)
        axes.set_ylabel("frames below the error [%]")
        add_legend(figure, axes)

    return PrintFigure(
        "cdf" if metric == WORST_METRICS[0] else f"cdf_{metric}",
        f"Share of frames whose {metric_name(metric)} is below a value: {frames:,} frames of {where}. Curves further left "
        f"are better. The axis is logarithmic.{describe_absent(condition.series, measured)}{run.missing_note}",
        draw,
        _HEIGHT_MM,
    )
