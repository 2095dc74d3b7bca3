"""Charts of a run's page: error over time with station quality, errors per joint, error distribution."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.report.kit.chart import add_legend, decimate, draw_chart, insert_gaps
from harness.report.kit.distribution_chart import draw_distribution
from harness.report.kit.highlights import Highlights
from harness.report.kit.hover_chart import BAND_OF
from harness.report.kit.metric_labels import metric_label
from harness.report.kit.rows import label_rows
from harness.report.kit.scales import set_root_scale
from harness.report.kit.style import (
    COLOURS,
    FAINT,
    GRID,
    INK,
    PAPER,
    Chart,
    hide_frame,
)
from harness.report.kit.text import to_file_name
from harness.report.kit.time_chart import draw_over_time
from harness.report.run.data import RunData, Trace
from harness.results.reported_metrics import PRIMARY_METRIC, SECONDARY_METRIC
from harness.score.pair import hinged_bones, joint_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AXIS_LABELS = {metric: metric_label(metric) for metric in (PRIMARY_METRIC, SECONDARY_METRIC)}
"""Metric -> label of its axis."""
SIGMA_BAND_NOTE = (
    " Shaded: up to the mean standard deviation that a method states for the hinges of a frame. Well-stated ones put "
    "the mean error at 0.8 of the band."
)
"""Sentence of a caption with such bands; 0.8 is the mean of an absolute normal error, sqrt(2 / pi)."""


def error_over_time(run: RunData, behaviour: str, highlights: Highlights) -> Chart:
    """Error over time of every method on the behaviour's clip with the largest mean error, and station quality."""
    traces = [trace for trace in run.traces if trace.behaviour == behaviour]
    clips = tuple(dict.fromkeys(trace.clip for trace in traces))
    clip = max(clips, key=lambda name: _mean([t.errors[PRIMARY_METRIC][t.scored] for t in traces if t.clip == name]))
    on_clip = [trace for trace in traces if trace.clip == clip]
    shown = {trace.series: trace for trace in reversed(on_clip) if trace.series in run.charted_series}
    which = clip + (f", the clip with the largest error of {len(clips)}" if len(clips) > 1 else "")
    bands = [trace for name, trace in shown.items() if len(trace.sigma_deg) and highlights.role(name)]

    def draw(figure: "Figure") -> None:
        rows = len(on_clip[0].stations)
        error, quality = figure.subplots(2, 1, sharex=True, height_ratios=(3.2, 0.22 * rows + 0.25))
        names = [name for name in run.charted_series if name in shown]
        lines = {
            name: (t.time_s, np.where(t.scored, t.errors[PRIMARY_METRIC], np.nan))
            for name, t in ((name, shown[name]) for name in names)
        }
        draw_over_time(error, lines, highlights, AXIS_LABELS[PRIMARY_METRIC])
        for trace in bands:
            _draw_sigma_band(error, trace, highlights)
        start = min((float(t.time_s[t.scored][0]) for t in on_clip if t.scored.any()), default=0.0)
        error.axvspan(0.0, start, color=GRID, linewidth=0, alpha=0.7)
        add_legend(figure, error)
        _draw_quality(quality, max(on_clip, key=lambda trace: len(trace.time_s)))

    return draw_chart(
        f"error_{to_file_name(behaviour)}",
        behaviour.replace("_", " "),
        f"{which}. {highlights.description} Shaded at the start: warm-up, not scored. Below: quality of each station, "
        f"from 1 (blue) to 0 (red, lost).{SIGMA_BAND_NOTE if bands else ''}{omitted_series_note(run)}",
        f"Joint angle error of methods over time on {clip}, and the quality of every station below it.",
        draw,
        2.6 + 0.2 * len(on_clip[0].stations),
        hover=True,
    )


def error_per_joint(run: RunData, highlights: Highlights) -> Chart:
    """Box plots of each joint's errors for the leader; medians of the control as points."""
    skeleton = standard_skeleton()
    bones = [skeleton.names[b] for b in hinged_bones(skeleton)]
    joints = list(joint_names(skeleton))
    leader, control = highlights.leader, highlights.control
    boxes = _pooled_errors(run, leader)
    points = _pooled_errors(run, control) if control else None
    has_points = points is not None and len(points[0]) > 0

    def draw(figure: "Figure") -> None:
        left, right = figure.subplots(1, 2)
        for axes, names, part, title in (
            (left, bones, 0, "rotation relative to the parent [deg]"),
            (right, joints, 1, "position of the far end [mm]"),
        ):
            draw_boxes(axes, boxes[part], COLOURS[1])
            if points is not None and has_points:
                median = np.median(points[part], axis=0)
                axes.plot(median, np.arange(len(names)), "o", markersize=3.5, color=COLOURS[0], label=control)
            label_rows(axes, names)
            set_root_scale(axes)
            axes.set_title(title)

    return draw_chart(
        "per_joint",
        f"Distribution at each joint, {leader}",
        f"{leader}: boxes from quartile to quartile, lines at the median, whiskers at the 5th and 95th percentile of "
        f"all scored frames.{f' Points: medians of {control}.' if has_points else ''} The axes have a square-root "
        "scale.",
        f"Box plots of the rotation error of 22 bones and the position error of 25 joint centres for {leader}.",
        draw,
        6.4,
    )


def error_distribution(run: RunData, highlights: Highlights) -> Chart:
    """Cumulative distribution of the errors of every method."""

    def values(metric: str, name: str) -> Floats:
        parts = [t.errors[metric][t.scored] for t in run.traces if t.series == name]
        return np.concatenate(parts or [np.empty(0)])

    def draw(figure: "Figure") -> None:
        styles = highlights.styles(run.charted_series)
        for axes, (metric, label) in zip(figure.subplots(1, 2, sharey=True), AXIS_LABELS.items(), strict=True):
            named = {name: values(metric, name) for name in styles}
            draw_distribution(axes, named, label, styles, highlights.role)
        first = figure.axes[0]
        first.set_ylabel("frames below the error [%]")
        add_legend(figure, first)

    return draw_chart(
        "error_cdf",
        "Error distribution",
        "Share of all scored frames of all clips whose error is below a value. Curves further left are better. "
        f"{highlights.description}{omitted_series_note(run)}",
        "Cumulative distribution of joint angle and joint position error of methods.",
        draw,
        3.3,
        hover=True,
    )


def omitted_series_note(run: RunData) -> str:
    """Sentence of a caption that says how many series have no line, or ""."""
    lines, series = len(run.charted_series), len(run.series)
    return f" Only the {lines} of {series} methods with the lowest errors are shown." if lines < series else ""


def _draw_quality(axes: "Axes", trace: Trace) -> None:
    """A band for each station, coloured by its quality."""
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("quality", ["#b2182b", "#f4a582", "#c6dcec", "#7fb2d6"])
    step_s = float(np.min(np.diff(trace.time_s), initial=1.0))
    columns = np.rint((trace.time_s - trace.time_s[0]) / step_s).astype(int)
    band = np.full((len(trace.stations), columns[-1] + 1), np.nan)
    band[:, columns] = trace.quality.T
    extent = (trace.time_s[0] - step_s / 2, trace.time_s[-1] + step_s / 2, len(trace.stations) - 0.5, -0.5)
    axes.imshow(band, aspect="auto", extent=extent, cmap=colours, vmin=0.0, vmax=1.0, interpolation="nearest")
    for edge in np.arange(0.5, len(trace.stations) - 1):
        axes.axhline(edge, color=PAPER, linewidth=1.5)
    hide_frame(axes)
    axes.set_yticks(range(len(trace.stations)), trace.stations)
    axes.set_xlabel("time [s]")


def _draw_sigma_band(axes: "Axes", trace: Trace, highlights: Highlights) -> None:
    """Shade the area up to the mean standard deviation of a frame's hinges."""
    bottom, top = axes.get_ylim()
    mean_deg = np.where(trace.scored, trace.sigma_deg.mean(axis=1), np.nan)
    time_s, mean_deg = decimate(*insert_gaps(trace.time_s, mean_deg))
    name = trace.series
    style = {"color": highlights.styles([name])[name]["color"], "alpha": 0.13, "linewidth": 0}
    label = f"{BAND_OF}{name}{highlights.role(name)}"
    axes.fill_between(time_s, bottom, np.maximum(mean_deg, bottom), label=label, **style)
    axes.set_ylim(bottom, np.nanmax(mean_deg, initial=top))


def _pooled_errors(run: RunData, series: str) -> tuple[Floats, Floats]:
    """Rotation (N, 22) [deg] and position (N, 25) [mm] errors of every scored frame of a series."""
    traces = [trace for trace in run.traces if trace.series == series]
    return np.concatenate([t.rotation_deg for t in traces]), np.concatenate([t.position_mm for t in traces])


def draw_boxes(axes: "Axes", values: Floats, colour: str) -> None:
    """A horizontal box for each column of (N, M) values. Axes.boxplot would import pyplot with its global state."""
    low, q1, middle, q3, high = np.quantile(values, [0.05, 0.25, 0.5, 0.75, 0.95], axis=0)
    places = np.arange(values.shape[1])
    axes.hlines(places, low, high, color=FAINT, linewidth=1.0)
    axes.barh(places, q3 - q1, left=q1, height=0.62, color=colour, alpha=0.55)
    axes.vlines(middle, places - 0.31, places + 0.31, color=INK, linewidth=1.6)


def _mean(parts: Sequence[Floats]) -> float:
    values = np.concatenate(parts)
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else -1.0
