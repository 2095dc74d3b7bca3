"""The figures of single frames: `time`, errors over time on one clip, and `cdf`, their cumulative distribution."""

from collections.abc import Mapping

import numpy as np

from harness.compare import shared_clips
from harness.core.number_format import count_noun
from harness.errors import BadInput
from harness.report.figures.conditions import (
    ConditionSet,
    RunCondition,
    check_metric,
    choose_condition,
    describe_absent,
    rank_highlights,
    read_series,
)
from harness.report.figures.print_figure import FigureSelection, PrintFigure
from harness.report.kit.chart import add_legend
from harness.report.kit.error_lines import Highlights, draw_distribution, draw_over_time
from harness.report.kit.style import Figure, print_line_style
from harness.report.kit.text import metric_label, metric_name, to_file_name
from harness.report.run.data import WORST_METRICS, Row, Trace

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
        lambda figure: _draw_over_time(figure, traces, metric, highlights),
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


def _draw_over_time(figure: Figure, traces: Mapping[str, Trace], metric: str, highlights: Highlights) -> None:
    axes = figure.subplots()
    lines = {name: (t.time_s, np.where(t.scored, t.errors[metric], np.nan)) for name, t in traces.items()}
    draw_over_time(axes, lines, highlights, metric_label(metric))
    scored = [trace.time_s[trace.scored] for trace in traces.values()]
    axes.set_xlim(min(times[0] for times in scored), max(times[-1] for times in scored))
    axes.set_xlabel("time [s]")
    add_legend(figure, axes)


_CDF_HEIGHT_MM = 60.0


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

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        styles = {name: print_line_style(n) for n, name in enumerate(measured)}
        draw_distribution(axes, measured, metric_label(metric), styles)
        axes.set_ylabel("frames below the error [%]")
        add_legend(figure, axes)

    return PrintFigure(
        "cdf" if metric == WORST_METRICS[0] else f"cdf_{metric}",
        f"Share of frames whose {metric_name(metric)} is below a value: {frames:,} frames of {where}. Curves further "
        f"left are better. The axis is logarithmic.{describe_absent(condition.series, measured)}{run.missing_note}",
        draw,
        _CDF_HEIGHT_MM,
    )
