"""The charts of a sweep: error against each key that varies, a small chart for each scenario that varies the key."""

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np

from harness.compare import MIN_UNITS, count_units, mean_interval
from harness.core.arrays import Floats
from harness.core.number_format import count_noun, format_number
from harness.report.kit.axes import label_rows
from harness.report.kit.chart import add_legend, draw_chart, label_line_ends
from harness.report.kit.style import GRID, Axes, Chart, Figure, series_style
from harness.report.kit.text import to_file_name, truncate
from harness.report.sweep.data import Statistic, SweepData, VariedKey, unit_of
from harness.report.sweep.effects import Interaction
from harness.results import PRIMARY_METRIC

MAX_SERIES, MAX_SCENARIOS, MAX_INTERVALS, MAX_LINES = 10, 12, 600, 6
"""Most series in a chart, scenarios with a chart for a key, intervals on a page (each needs a bootstrap), and lines of
an interaction."""
_WIDTH_IN, _LINES_IN, _ROW_IN, _LETTER_IN = 4.2, 2.7, 0.085, 0.165
_LETTERS, _MOST_ROWS, _MOST_NAMED, _MOST_LETTERS, _MOST_TICKS = 18, 4, 8, 44, 5
"""Letters of a name next to an axis, and its most rows; most lines with names at their ends; letters of a name in a
legend; most tick labels of a logarithmic axis."""
_TICK_GAP = 0.12
"""Least distance of the values that have tick labels of their own, as a share of the axis."""
_LOG_SCALE_RATIO = 30.0
"""The axis is logarithmic if the last of its positive values is more than this many times the first."""


Curves = Mapping[int, Sequence[Statistic]]
"""Index of a series -> the statistic of its error at each value of a key."""


def curves(
    sweep: SweepData, key: VariedKey, scenario: int, metric: str = PRIMARY_METRIC, *, with_intervals: bool = True
) -> Curves:
    """The curve of each series that was measured, in the order of the sweep; those that are drawn have intervals."""

    def points(series: int, with_interval: bool = False) -> list[Statistic]:
        cells = (sweep.select(scenario, series, **{key.name: value}) for value in range(len(key.labels)))
        return [sweep.statistic(metric, selected, with_interval=with_interval) for selected in cells]

    found = {series: points(series) for series in range(len(sweep.series))}
    measured = {series: of for series, of in found.items() if any(point.mean is not None for point in of)}
    drawn = {series: points(series, True) for series in select_curves(measured)} if with_intervals else {}
    return {**measured, **drawn}


def select_curves(measured: Curves) -> Curves:
    """The curves with the lowest errors, as many as a chart shows, in the order of the sweep."""

    def mean(series: int) -> float:
        return float(np.mean([point.mean for point in measured[series] if point.mean is not None]))

    return {series: measured[series] for series in sorted(sorted(measured, key=mean)[:MAX_SERIES])}


def scenarios_varying(sweep: SweepData, key: VariedKey) -> list[int]:
    """The scenarios whose cells take several values of the key."""
    values = sweep.value_of[key.name]
    return [
        n for n in range(len(sweep.scenarios)) if len(np.unique(values[(sweep.scenario_of == n) & (values >= 0)])) > 1
    ]


def interaction_chart(interaction: Interaction) -> Chart:
    """The error against one key, a line for each value of the other, with the interval of each mean."""
    key, by = interaction.key, interaction.by
    shown = sorted({int(n) for n in np.linspace(0, len(key.labels) - 1, MAX_LINES).round()})
    lines = {n: [_statistic(interaction.errors[:, n, at]) for at in range(len(by.labels))] for n in shown}
    names = [f"{key.name} {text}" for text in key.labels]
    values = "; ".join(f"{names[n]} {_curve_values_text(line, by)}" for n, line in lines.items())
    more = f" {len(shown)} of {len(key.labels)} values of {key.name} are shown." if len(shown) < len(key.labels) else ""
    return draw_chart(
        f"interaction_{to_file_name(key.name)}_{to_file_name(by.name)}",
        f"{key.name} and {by.name}",
        f"Mean over {count_units(interaction.units)} with 95 % intervals; lines that are not parallel show an "
        f"interaction, if it can be told.{more}",
        f"{PRIMARY_METRIC} [{unit_of(PRIMARY_METRIC)}] against {by.name}: {values}.",
        lambda figure: _draw(figure, by, lines, names),
        3.0 if by.numbers else _dot_chart_height_in(by, len(lines)),
        width_in=7.0,
    )


def _statistic(errors: Floats) -> Statistic:
    low, high = mean_interval(errors) if len(errors) >= MIN_UNITS else (None, None)
    return Statistic(float(errors.mean()), len(errors), None, low, high, len(errors))


def _count_range(counts: Sequence[int], noun: str) -> str:
    least, most = min(counts), max(counts)
    return count_noun(most, noun) if least == most else f"{least} to {count_noun(most, noun)}"


def sweep_chart(sweep: SweepData, key: VariedKey, scenario: int, measured: Curves) -> Chart:
    """The chart of one key and scenario."""
    shown = select_curves(measured)
    omitted = len(shown) < len(measured)
    note = f" Only the {len(shown)} of {len(measured)} methods with the lowest errors are shown." if omitted else ""
    points = [point for curve in shown.values() for point in curve if point.clips]
    over = _count_range([point.clips for point in points], "clip")
    if all(point.units for point in points):
        over = f"{_count_range([point.units for point in points], 'unit')} ({over})"
    caption = f"Mean over {over}.{note}"
    values = "; ".join(f"{sweep.series[n]} {_curve_values_text(curve, key)}" for n, curve in shown.items())
    name = f"{to_file_name(key.name)}_{to_file_name(sweep.scenarios[scenario])}"
    return draw_chart(
        f"varied_{name}",
        f"{key.name}, {sweep.scenarios[scenario]}" if len(sweep.scenarios) > 1 else key.name,
        caption,
        f"{PRIMARY_METRIC} [{unit_of(PRIMARY_METRIC)}] against {key.name}: {values}.",
        lambda figure: _draw(figure, key, shown, sweep.series),
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


def _draw(figure: Figure, key: VariedKey, shown: Curves, names: Sequence[str]) -> None:
    axes = figure.subplots()
    if not key.numbers:
        _draw_dots(axes, key, shown, names)
        add_legend(figure, axes)
        return
    ends = _draw_lines(axes, key, shown, names)
    if len(ends) <= _MOST_NAMED and all(len(name) <= _LETTERS for _, name, _ in ends):
        label_line_ends(axes, ends)
    else:
        add_legend(figure, axes)


def _draw_lines(axes: Axes, key: VariedKey, shown: Curves, names: Sequence[str]) -> list[tuple[float, str, str]]:
    """Draw each curve; returns the last value, name and colour of each."""
    ends = []
    for series, curve in shown.items():
        style = series_style(series)
        measured = [(x, point) for x, point in zip(key.numbers, curve, strict=True) if point.mean is not None]
        y = [float(point.mean or 0.0) for _, point in measured]
        axes.plot([x for x, _ in measured], y, markersize=4.0, label=truncate(names[series], _MOST_LETTERS), **style)
        ends.append((y[-1], names[series], style["color"]))
        for x, point in measured:
            low, high = point.low, point.high
            if low is not None and high is not None:
                axes.plot([x] * 2, [low, high], color=style["color"], linewidth=1.1, alpha=0.7)
    if key.numbers[0] > 0.0 and key.numbers[-1] > _LOG_SCALE_RATIO * key.numbers[0]:
        axes.set_xscale("log")
        every = -(-len(key.numbers) // _MOST_TICKS)
        axes.set_xticks(key.numbers[::every], key.labels[::every])
        axes.set_xticks([], minor=True)
    elif min(np.diff(key.numbers), default=0.0) > _TICK_GAP * (key.numbers[-1] - key.numbers[0]):
        axes.set_xticks(key.numbers, key.labels)
    axes.set_xlabel(key.name)
    axes.set_ylabel(f"joint angle error [{unit_of(PRIMARY_METRIC)}]")
    axes.set_ylim(bottom=0.0)
    return ends


def _draw_dots(axes: Axes, key: VariedKey, shown: Curves, names: Sequence[str]) -> None:
    """Draw a row for each value with a dot for each series."""
    step = 0.8 / max(len(shown), 1)
    for row, (series, curve) in enumerate(shown.items()):
        style, label = series_style(series), truncate(names[series], _MOST_LETTERS)
        for value, point in enumerate(curve):
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


def _curve_values_text(curve: Sequence[Statistic], key: VariedKey) -> str:
    values = [
        f"{format_number(point.mean, unit_of(PRIMARY_METRIC))} at {text}"
        for text, point in zip(key.labels, curve, strict=True)
        if point.mean is not None
    ]
    return ", ".join(values)
