"""The figure `time`: error over time on one clip; the leader and a control in colour, the other methods grey."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.compare.ranking import shared_clips
from harness.errors import BadInput
from harness.report.figures.conditions import ConditionSet, RunCondition, check_metric, describe_absent
from harness.report.figures.selection import FigureSelection
from harness.report.figures.traces import Highlights, choose_condition, choose_highlights, read_series
from harness.report.kit.chart import add_legend, insert_gaps
from harness.report.kit.metric_labels import metric_label, quantity
from harness.report.kit.print_figure import PrintFigure
from harness.report.kit.scales import set_log_scale
from harness.report.kit.style import COLOURS, DASHES, mark_scale, muted_line_style
from harness.report.kit.text import to_file_name
from harness.report.run.data import WORST_METRICS, Row, Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEIGHT_MM = 60.0
_LEADER: Mapping[str, Any] = {"color": COLOURS[1], "linestyle": "solid", "linewidth": 1.3, "zorder": 4}
_CONTROL: Mapping[str, Any] = {"color": COLOURS[0], "linestyle": DASHES[1], "linewidth": 1.1, "zorder": 3}
_MARKERS_PER_LINE = 8


def over_time_figure(run: ConditionSet, selection: FigureSelection) -> PrintFigure:
    """Error of every method on one clip, by default the one with the largest mean error."""
    metric = selection.metric
    check_metric(metric, WORST_METRICS, "metric of which the error is drawn over time")
    condition = choose_condition(run, selection)
    highlights = choose_highlights(condition, selection)
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
        f"{quantity(metric).capitalize()} over time on {where}. {_describe(highlights)} "
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


def _describe(highlights: Highlights) -> str:
    """Sentence of the caption on the coloured lines."""
    control = f", orange and dashed: {highlights.control}, the control" if highlights.control else ""
    return f"Blue: {highlights.leader}, the method with the lowest mean joint angle error over all clips{control}."


def _draw(figure: "Figure", traces: Mapping[str, Trace], metric: str, highlights: Highlights) -> None:
    axes = figure.subplots()
    coloured = {highlights.leader: _LEADER, highlights.control: _CONTROL}
    others = [name for name in traces if name not in coloured]
    for name in _front_first(traces, highlights):
        trace = traces[name]
        values = np.where(trace.scored, trace.errors[metric], np.nan)
        style = coloured.get(name) or {**muted_line_style(others.index(name)), "linewidth": 0.8, "zorder": 2}
        time_s, values = insert_gaps(trace.time_s, values)
        every = max(1, len(time_s) // _MARKERS_PER_LINE)
        label = name + highlights.role(name)
        axes.plot(time_s, values, label=label, markevery=every, markersize=3.0 * mark_scale(), **style)
    set_log_scale(axes, "y")
    scored = [trace.time_s[trace.scored] for trace in traces.values()]
    axes.set_xlim(min(times[0] for times in scored), max(times[-1] for times in scored))
    axes.set_xlabel("time [s]")
    axes.set_ylabel(metric_label(metric))
    add_legend(figure, axes)


def _front_first(traces: Mapping[str, Trace], highlights: Highlights) -> Sequence[str]:
    """The series in the order of the legend: the leader, the control, the others."""
    first = [name for name in (highlights.leader, highlights.control) if name and name in traces]
    return [*first, *(name for name in traces if name not in first)]
