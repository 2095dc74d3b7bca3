"""The charts of a sweep: error against each varied key, a small chart for each scenario that varies the key."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.number_format import count_noun, format_number
from harness.report.kit.axes import label_rows
from harness.report.kit.chart import add_legend, draw_chart, label_line_ends
from harness.report.kit.style import GRID, Axes, Chart, Figure, series_style
from harness.report.kit.text import to_file_name, truncate
from harness.report.sweep.data import Statistic, SweepData, VariedKey, unit_of
from harness.results.reported_metrics import PRIMARY_METRIC

MAX_SERIES, MAX_SCENARIOS, MAX_INTERVALS = 10, 12, 600
"""Most series in a chart, scenarios with a chart for a key, and intervals on a page (each needs a bootstrap)."""
_WIDTH_IN, _LINES_IN, _ROW_IN, _LETTER_IN = 4.2, 2.7, 0.085, 0.165
_LETTERS, _MOST_ROWS, _MOST_NAMED, _MOST_LETTERS, _MOST_TICKS = 18, 4, 8, 44, 5
"""Letters of a name next to an axis, and its most rows; most lines with names at their ends; letters of a name in a
legend; most tick labels of a logarithmic axis."""
_LOG_SCALE_RATIO = 30.0
"""The axis is logarithmic if the last of its positive values is more than this many times the first."""


@dataclass(frozen=True)
class Curve:
    """The error of one series of one scenario against a key."""

    name: str
    colour_index: int
    """Index of its colour."""
    points: tuple[Statistic, ...]
    """Statistic of each value of the key."""


def curves(
    sweep: SweepData, key: VariedKey, scenario: int, metric: str = PRIMARY_METRIC, *, with_intervals: bool = True
) -> list[Curve]:
    """The curve of each series that was measured, in the order of the sweep; those that are drawn have intervals."""
    measured = [_curve(sweep, key, scenario, n, metric) for n in range(len(sweep.series))]
    measured = [curve for curve in measured if any(point.mean is not None for point in curve.points)]
    drawn = {curve.colour_index for curve in select_curves(measured)} if with_intervals else set()
    return [
        _curve(sweep, key, scenario, c.colour_index, metric, with_intervals=True) if c.colour_index in drawn else c
        for c in measured
    ]


def select_curves(measured: Sequence[Curve]) -> list[Curve]:
    """The curves with the lowest errors, as many as a chart shows, in the order of the sweep."""
    return sorted(sorted(measured, key=_curve_mean)[:MAX_SERIES], key=lambda curve: curve.colour_index)


def _curve(
    sweep: SweepData, key: VariedKey, scenario: int, series: int, metric: str, *, with_intervals: bool = False
) -> Curve:
    cells = [sweep.select(scenario, series, **{key.name: value}) for value in range(len(key.labels))]
    points = (sweep.statistic(metric, selected, with_interval=with_intervals) for selected in cells)
    return Curve(sweep.series[series], series, tuple(points))


def scenarios_varying(sweep: SweepData, key: VariedKey) -> list[int]:
    """The scenarios whose cells take several values of the key."""
    values = sweep.value_of[key.name]
    return [
        n for n in range(len(sweep.scenarios)) if len(np.unique(values[(sweep.scenario_of == n) & (values >= 0)])) > 1
    ]


def _count_range(counts: Sequence[int], noun: str) -> str:
    least, most = min(counts), max(counts)
    return count_noun(most, noun) if least == most else f"{least} to {count_noun(most, noun)}"


def sweep_chart(sweep: SweepData, key: VariedKey, scenario: int, measured: Sequence[Curve]) -> Chart:
    """The chart of one key and scenario."""
    shown = select_curves(measured)
    omitted = len(shown) < len(measured)
    note = f" Only the {len(shown)} of {len(measured)} methods with the lowest errors are shown." if omitted else ""
    points = [point for curve in shown for point in curve.points if point.clips]
    over = _count_range([point.clips for point in points], "clip")
    if all(point.units for point in points):
        over = f"{_count_range([point.units for point in points], 'unit')} ({over})"
    caption = f"Mean over {over}.{note}"
    values = "; ".join(f"{curve.name} {_curve_values_text(curve, key)}" for curve in shown)
    name = f"{to_file_name(key.name)}_{to_file_name(sweep.scenarios[scenario])}"
    return draw_chart(
        f"varied_{name}",
        f"{key.name}, {sweep.scenarios[scenario]}" if len(sweep.scenarios) > 1 else key.name,
        caption,
        f"{PRIMARY_METRIC} [{unit_of(PRIMARY_METRIC)}] against {key.name}: {values}.",
        lambda figure: _draw(figure, key, shown),
        _LINES_IN if key.numbers else _dot_chart_height_in(key, len(shown)),
        width_in=_WIDTH_IN,
    )


def _dot_chart_height_in(key: VariedKey, series: int) -> float:
    """Height of a chart with a row for each value, as high as its label or its dots need [in]."""
    rows = max(1 + text.count("\n") for text in _row_labels(key))
    return 0.75 + len(key.labels) * max(_ROW_IN * (series + 1), _LETTER_IN * rows + 0.08)


def _row_labels(key: VariedKey) -> list[str]:
    """The labels of the values in several rows, broken after a plus sign if possible."""
    out = []
    for text in key.labels:
        rows = [row.replace("+ ", "+") for row in textwrap.wrap(text.replace("+", "+ "), _LETTERS)]
        more = "…" if len(rows) > _MOST_ROWS else ""
        out.append("\n".join(rows[:_MOST_ROWS]) + more)
    return out


def _draw(figure: Figure, key: VariedKey, shown: Sequence[Curve]) -> None:
    axes = figure.subplots()
    if not key.numbers:
        _draw_dots(axes, key, shown)
        add_legend(figure, axes)
        return
    ends = _draw_lines(axes, key, shown)
    if len(ends) <= _MOST_NAMED and all(len(name) <= _LETTERS for _, name, _ in ends):
        label_line_ends(axes, ends)
    else:
        add_legend(figure, axes)


def _draw_lines(axes: Axes, key: VariedKey, shown: Sequence[Curve]) -> list[tuple[float, str, str]]:
    """Draw each curve; returns the last value, name and colour of each."""
    ends = []
    for curve in shown:
        style = series_style(curve.colour_index)
        measured = [n for n, point in enumerate(curve.points) if point.mean is not None]
        x, y = [key.numbers[n] for n in measured], [float(curve.points[n].mean or 0.0) for n in measured]
        axes.plot(x, y, markersize=4.0, label=truncate(curve.name, _MOST_LETTERS), **style)
        ends.append((y[-1], curve.name, style["color"]))
        for n in measured:
            low, high = curve.points[n].low, curve.points[n].high
            if low is not None and high is not None:
                axes.plot([key.numbers[n]] * 2, [low, high], color=style["color"], linewidth=1.1, alpha=0.7)
    if key.numbers[0] > 0.0 and key.numbers[-1] > _LOG_SCALE_RATIO * key.numbers[0]:
        axes.set_xscale("log")
        every = -(-len(key.numbers) // _MOST_TICKS)
        axes.set_xticks(key.numbers[::every], key.labels[::every])
        axes.set_xticks([], minor=True)
    axes.set_xlabel(key.name)
    axes.set_ylabel(f"joint angle error [{unit_of(PRIMARY_METRIC)}]")
    axes.set_ylim(bottom=0.0)
    return ends


def _draw_dots(axes: Axes, key: VariedKey, shown: Sequence[Curve]) -> None:
    """Draw a row for each value with a dot for each series."""
    step = 0.8 / max(len(shown), 1)
    for row, curve in enumerate(shown):
        style, label = series_style(curve.colour_index), truncate(curve.name, _MOST_LETTERS)
        for value, point in enumerate(curve.points):
            if point.mean is None:
                continue
            y = value + step * (row - 0.5 * (len(shown) - 1))
            if point.low is not None and point.high is not None:
                axes.plot([point.low, point.high], [y, y], color=style["color"], linewidth=1.4, alpha=0.7)
            axes.plot([point.mean], [y], markersize=4.5, label=label, **{**style, "linestyle": "none"})
            label = "_"
    label_rows(axes, _row_labels(key))
    axes.set_xlabel(f"joint angle error [{unit_of(PRIMARY_METRIC)}]")
    axes.set_xlim(left=0.0)
    for edge in range(1, len(key.labels)):
        axes.axhline(edge - 0.5, color=GRID, linewidth=0.8)


def _curve_mean(curve: Curve) -> float:
    means = [point.mean for point in curve.points if point.mean is not None]
    return sum(means) / len(means)


def _curve_values_text(curve: Curve, key: VariedKey) -> str:
    values = [
        f"{format_number(point.mean, unit_of(PRIMARY_METRIC))} at {text}"
        for text, point in zip(key.labels, curve.points, strict=True)
        if point.mean is not None
    ]
    return ", ".join(values)
