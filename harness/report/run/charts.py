"""Charts of a run's page: error over time with station quality, error distribution, error against a varied key."""

from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.report.kit.chart import add_legend, decimate, draw_chart, insert_gaps
from harness.report.kit.error_lines import Highlights, draw_distribution, draw_over_time
from harness.report.kit.inline_svg import BAND_OF
from harness.report.kit.style import GRID, PAPER, Axes, Chart, Figure, hide_frame
from harness.report.kit.text import metric_label, to_file_name
from harness.report.run.data import RunData, Trace
from harness.report.run.tables import rows_by_setting
from harness.results import PRIMARY_METRIC, SECONDARY_METRIC, varied_text

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

    def draw(figure: Figure) -> None:
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


def error_distribution(run: RunData, highlights: Highlights) -> Chart:
    """Cumulative distribution of the errors of every method."""

    def values(metric: str, name: str) -> Floats:
        parts = [t.errors[metric][t.scored] for t in run.traces if t.series == name]
        return np.concatenate(parts or [np.empty(0)])

    def draw(figure: Figure) -> None:
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


def effect_charts(run: RunData, highlights: Highlights) -> list[Chart]:
    """For each behaviour a chart of the error against the varied key; none unless one key takes several numbers."""
    values = [row["varied"] for row in run.full_summary["cells"]]
    keys = {key for varied in values for key in varied}
    if len(keys) != 1 or len({varied_text(varied) for varied in values}) < 2:
        return []
    (key,) = keys
    if not all(isinstance(varied[key], int | float) and not isinstance(varied[key], bool) for varied in values):
        return []
    return [_effect_chart(run, behaviour, key, highlights) for behaviour in run.behaviours]


def _effect_chart(run: RunData, behaviour: str, key: str, highlights: Highlights) -> Chart:
    by_series = rows_by_setting(run, behaviour)
    names = [name for name in run.charted_series if name in by_series]

    def draw(figure: Figure) -> None:
        styles = highlights.styles(names)
        for axes, (metric, label) in zip(figure.subplots(1, 2), AXIS_LABELS.items(), strict=True):
            for name, style in styles.items():
                points = sorted(
                    (row["varied"][key], row["metrics"][metric]["mean"]) for row in by_series[name].values()
                )
                measured = [(x, y) for x, y in points if y is not None]
                if measured:
                    options = {**style, "marker": style.get("marker") or "o", "markersize": 3.5}
                    axes.plot(*zip(*measured, strict=True), label=name + highlights.role(name), **options)
            axes.set_xlabel(key)
            axes.set_ylabel(label)
            axes.set_ylim(bottom=0.0)
        add_legend(figure, figure.axes[0])

    return draw_chart(
        f"varied_{to_file_name(key)}_{to_file_name(behaviour)}",
        f"{behaviour.replace('_', ' ')}: error against {key}",
        f"Mean over clips; the tables below have the numbers. {highlights.description}{omitted_series_note(run)}",
        f"Joint angle and joint position error of {len(names)} methods against {key}.",
        draw,
        3.6,
        hover=True,
    )


def omitted_series_note(run: RunData) -> str:
    """Sentence of a caption that says how many series have no line, or ""."""
    lines, series = len(run.charted_series), len(run.series)
    return f" Only the {lines} of {series} methods with the lowest errors are shown." if lines < series else ""


def _draw_quality(axes: Axes, trace: Trace) -> None:
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


def _draw_sigma_band(axes: Axes, trace: Trace, highlights: Highlights) -> None:
    """Shade the area up to the mean standard deviation of a frame's hinges."""
    bottom, top = axes.get_ylim()
    mean_deg = np.where(trace.scored, trace.sigma_deg.mean(axis=1), np.nan)
    time_s, mean_deg = decimate(*insert_gaps(trace.time_s, mean_deg))
    name = trace.series
    style = {"color": highlights.styles([name])[name]["color"], "alpha": 0.13, "linewidth": 0}
    label = f"{BAND_OF}{name}{highlights.role(name)}"
    axes.fill_between(time_s, bottom, np.maximum(mean_deg, bottom), label=label, **style)
    axes.set_ylim(bottom, np.nanmax(mean_deg, initial=top))


def _mean(parts: Sequence[Floats]) -> float:
    values = np.concatenate(parts)
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else -1.0
