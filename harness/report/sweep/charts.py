"""The charts of a sweep: the error against each varied key, a small one for each scenario that varies it."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harness.report.kit.style import COLOURS, GRID, Chart, line_style
from harness.report.paper.line_chart import label_line_ends
from harness.report.run.charts import add_legend, draw_chart
from harness.report.run.data import to_file_name
from harness.report.run.tables import format_number
from harness.report.sweep.data import PRIMARY_METRIC, Statistic, SweepData, VariedKey, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_SERIES, MAX_SCENARIOS, MAX_INTERVALS = 10, 12, 600
"""In one chart; that have a chart for a key; that are worked out for one page, for each takes a moment."""
_WIDTH_IN, _LINES_IN, _ROW_IN, _LETTER_IN = 4.2, 2.7, 0.085, 0.165
_LETTERS, _MOST_ROWS, _MOST_NAMED, _MOST_LETTERS, _MOST_TICKS = 18, 4, 8, 44, 5
"""Of a name beside an axis; rows of it; lines that have their names at their ends; letters of a name in a legend;
values that a logarithmic axis names."""
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_LOG_SCALE_RATIO = 30.0
"""Positive values that reach so many times as far as the first have a logarithmic axis."""


@dataclass(frozen=True)
class Curve:
    """One series of one scenario against a key."""

    name: str
    colour_index: int
    """Which colour."""
    points: tuple[Statistic, ...]
    """For each value of the key."""


def curves(
    sweep: SweepData, key: VariedKey, scenario: int, metric: str = PRIMARY_METRIC, *, ends: bool = True
) -> list[Curve]:
    """Of each series that has anything there, in the order of the sweep; intervals for those that are drawn."""
    found = [_curve(sweep, key, scenario, place, metric) for place in range(len(sweep.series))]
    found = [curve for curve in found if any(point.mean is not None for point in curve.points)]
    drawn = {curve.colour_index for curve in select_curves(found)} if ends else set()
    return [
        _curve(sweep, key, scenario, c.colour_index, metric, ends=True) if c.colour_index in drawn else c for c in found
    ]


def select_curves(found: Sequence[Curve]) -> list[Curve]:
    """The series with the least error, as many as can be told apart, in the order of the sweep."""
    return sorted(sorted(found, key=_curve_mean)[:MAX_SERIES], key=lambda curve: curve.colour_index)


def _curve(sweep: SweepData, key: VariedKey, scenario: int, place: int, metric: str, *, ends: bool = False) -> Curve:
    chosen = [sweep.select(scenario, place, **{key.name: value}) for value in range(len(key.labels))]
    return Curve(sweep.series[place], place, tuple(sweep.statistic(metric, one, ends=ends) for one in chosen))


def scenarios_varying(sweep: SweepData, key: VariedKey) -> list[int]:
    """The scenarios whose cells take several values of the key."""
    values = sweep.value_of[key.name]
    return [
        n for n in range(len(sweep.scenarios)) if len(np.unique(values[(sweep.scenario_of == n) & (values >= 0)])) > 1
    ]


def sweep_chart(sweep: SweepData, key: VariedKey, scenario: int, found: Sequence[Curve]) -> Chart:
    """Of one scenario."""
    shown = select_curves(found)
    some = f" Shown are the {len(shown)} of {len(found)} with the least error." if len(shown) < len(found) else ""
    counts = sorted({point.clips for curve in shown for point in curve.points if point.clips})
    clips = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    caption = f"Mean over {clips} clip{'s'[: counts[-1] != 1]}.{some}"
    told = "; ".join(f"{curve.name} {_curve_values_text(curve, key)}" for curve in shown)
    name = f"{to_file_name(key.name)}_{to_file_name(sweep.scenarios[scenario])}"
    return draw_chart(
        f"varied_{name}",
        f"{key.name}, {sweep.scenarios[scenario]}" if len(sweep.scenarios) > 1 else key.name,
        caption,
        f"{PRIMARY_METRIC} [{unit_of(PRIMARY_METRIC)}] against {key.name}: {told}.",
        lambda figure: _draw(figure, key, shown),
        _LINES_IN if key.numbers else _dot_chart_height_in(key, len(shown)),
        width_in=_WIDTH_IN,
    )


def _dot_chart_height_in(key: VariedKey, series: int) -> float:
    """Height with a row for each value, as high as its name or its dots need."""
    rows = max(1 + text.count("\n") for text in _row_labels(key))
    return 0.75 + len(key.labels) * max(_ROW_IN * (series + 1), _LETTER_IN * rows + 0.08)


def _row_labels(key: VariedKey) -> list[str]:
    """Values in several rows, broken after a plus where they can be."""
    out = []
    for text in key.labels:
        rows = [row.replace("+ ", "+") for row in textwrap.wrap(text.replace("+", "+ "), _LETTERS)]
        more = "…" if len(rows) > _MOST_ROWS else ""
        out.append("\n".join(rows[:_MOST_ROWS]) + more)
    return out


def _draw(figure: "Figure", key: VariedKey, shown: Sequence[Curve]) -> None:
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


def _draw_lines(axes: "Axes", key: VariedKey, shown: Sequence[Curve]) -> list[tuple[float, str, str]]:
    """Each series; last value, name and colour of each."""
    ends = []
    for curve in shown:
        style = line_style(curve.colour_index)
        at = [n for n, point in enumerate(curve.points) if point.mean is not None]
        x, y = [key.numbers[n] for n in at], [float(curve.points[n].mean or 0.0) for n in at]
        axes.plot(x, y, marker=_marker(curve), markersize=4.0, label=_shorten(curve.name), **style)
        ends.append((y[-1], curve.name, style["color"]))
        for n in at:
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


def _draw_dots(axes: "Axes", key: VariedKey, shown: Sequence[Curve]) -> None:
    """A row for each value, in it a dot for each series."""
    step = 0.8 / max(len(shown), 1)
    for row, curve in enumerate(shown):
        colour, label = line_style(curve.colour_index)["color"], _shorten(curve.name)
        for value, point in enumerate(curve.points):
            if point.mean is None:
                continue
            y = value + step * (row - 0.5 * (len(shown) - 1))
            if point.low is not None and point.high is not None:
                axes.plot([point.low, point.high], [y, y], color=colour, linewidth=1.4, alpha=0.7)
            axes.plot([point.mean], [y], _marker(curve), markersize=4.5, color=colour, label=label)
            label = "_"
    axes.set_yticks(range(len(key.labels)), _row_labels(key))
    axes.set_ylim(len(key.labels) - 0.5, -0.5)
    axes.set_xlabel(f"joint angle error [{unit_of(PRIMARY_METRIC)}]")
    axes.set_xlim(left=0.0)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    for edge in range(1, len(key.labels)):
        axes.axhline(edge - 0.5, color=GRID, linewidth=0.8)


def _shorten(name: str) -> str:
    return name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 1]}…"


def _marker(curve: Curve) -> str:
    """Told apart by shape as well as by colour."""
    return _MARKERS[(curve.colour_index + curve.colour_index // len(COLOURS)) % len(_MARKERS)]


def _curve_mean(curve: Curve) -> float:
    known = [point.mean for point in curve.points if point.mean is not None]
    return sum(known) / len(known)


def _curve_values_text(curve: Curve, key: VariedKey) -> str:
    figures = [
        f"{format_number(point.mean, unit_of(PRIMARY_METRIC))} at {text}"
        for text, point in zip(key.labels, curve.points, strict=True)
        if point.mean is not None
    ]
    return ", ".join(figures)
