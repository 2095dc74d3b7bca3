"""The figure `time`: error over time on one clip; the leader and a control in colour, the other methods grey."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from harness.compare.ranking import shared_clips
from harness.errors import BadInput
from harness.report.figures.conditions import ConditionSet, RunCondition, check_metric, describe_absent
from harness.report.figures.selection import FigureSelection
from harness.report.figures.traces import choose_condition, rank_highlights, read_series
from harness.report.kit.chart import add_legend
from harness.report.kit.highlights import Highlights
from harness.report.kit.metric_labels import metric_label, metric_name
from harness.report.kit.print_figure import PrintFigure
from harness.report.kit.text import to_file_name
from harness.report.kit.time_chart import draw_over_time
from harness.report.run.data import WORST_METRICS, Row, Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEIGHT_MM = 60.0


def over_time_figure(run: ConditionSet, selection: FigureSelection) -> PrintFigure:
    """Error of every method on one clip, by default the one with the largest mean error."""
    metric = selection.metric
    check_metric(metric, WORST_METRICS, "metric of which the error is drawn over time")
    condition = choose_condition(run, selection)
    highlights = rank_highlights(condition, selection)
    clip, why = _choose_clip(condition, selection)
    seed = next(row["seed"] for row in condition.cells if row["clip"] == clip)

    def keep(_: str, row: Row) -> bool:
        return bool(row["clip"] == clip and row["seed"] == seed)

    traces = {name: of[0] for name, of in read_series(run.folder, condition, keep).items() if of[0].scored.any()}
    if not traces:
        raise BadInput(f"No method was measured on {clip}.", "Choose another clip with --clip.")
    where = f"{clip}{why}" + (f", {condition.name}" if condition.name else "")
    return PrintFigure(
        f"time_{to_file_name(clip)}" + ("" if metric == WORST_METRICS[0] else f"_{metric}"),
        f"{metric_name(metric).capitalize()} over time on {where}. {highlights.description} "
        "The warm-up is left out. The axis is logarithmic."
        f"{describe_absent(condition.series, traces)}{run.missing_note}",
        lambda figure: _draw(figure, traces, metric, highlights),
        _HEIGHT_MM,
    )


def _choose_clip(condition: RunCondition, selection: FigureSelection) -> tuple[str, str]:
    """The clip, and why it was chosen if nobody named it."""
    if selection.clip:
        return selection.clip, ""
    by_series = [of[selection.metric] for of in condition.values().values() if of.get(selection.metric)]
    clips = shared_clips(by_series) or condition.clips
    means = {clip: np.mean([by_clip[clip] for by_clip in by_series if clip in by_clip] or [-1.0]) for clip in clips}
    clip = max(clips, key=lambda name: means[name])
    return clip, f", of {len(clips)} clips the one with the largest mean error" if len(clips) > 1 else ""


def _draw(figure: "Figure", traces: Mapping[str, Trace], metric: str, highlights: Highlights) -> None:
    axes = figure.subplots()
    lines = {name: (t.time_s, np.where(t.scored, t.errors[metric], np.nan)) for name, t in traces.items()}
    draw_over_time(axes, lines, highlights, metric_label(metric))
    scored = [trace.time_s[trace.scored] for trace in traces.values()]
    axes.set_xlim(min(times[0] for times in scored), max(times[-1] for times in scored))
    axes.set_xlabel("time [s]")
    add_legend(figure, axes)
