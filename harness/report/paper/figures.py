"""Bar charts and line charts of a paper's page: values, intervals, standard deviations and published values."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import format_number
from harness.report.kit.chart import add_legend, decimate, label_line_ends
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Axes, Figure, series_colour, series_style
from harness.results.findings import BarChart, LineChart

_HATCHES = ("", "////", "....", "xxxx")
"""Fill patterns of grey bars."""
_LETTERS, _HORIZONTAL_LETTERS, _MOST_ROWS = 96, 34, 3
"""Letters under all vertical bars together; before a horizontal bar; most rows of text under a vertical bar."""
_MOST_VERTICAL, _MOST_NUMBERED, _MOST_HORIZONTAL_NUMBERED = 45, 25, 64
"""Most vertical bars; most bars with their number at the end, vertical and horizontal."""
_BAR_IN, _THIN_IN, _GROUP_IN, _FRAME_IN, _VERTICAL_IN = 0.15, 0.07, 0.09, 0.75, 3.4
"""Heights [in]: a horizontal bar with its number and without, gap between groups, frame; chart of vertical bars."""
_GROUP = 0.82
"""Share of the distance between groups that bars fill."""
SeriesValues = Mapping[str, Sequence[float | None]]
"""Series -> a value for each group or point; None where nothing was measured."""


def value_at(values: SeriesValues, series: str, n: int) -> float | None:
    """Value of a series in the n-th group; None where nothing was measured or the series is missing."""
    row = values.get(series, ())
    return row[n] if n < len(row) else None


def series_values(values: SeriesValues, series: str, count: int) -> Floats:
    """(count,) values of one series, NaN where nothing was measured."""
    row = [value_at(values, series, n) for n in range(count)]
    return np.array([np.nan if value is None else value for value in row], dtype=float)


def draw_bars(figure: Figure, bars: BarChart, colour_indices: Mapping[str, int]) -> None:
    """Draw the chart; `colour_indices` gives each series the index of its colour."""
    axes, horizontal, count = figure.subplots(), is_horizontal(bars), len(bars.groups)
    thick = _GROUP / max(len(bars.series), 1)
    diamonds, has_negative = list[tuple[Floats, Floats]](), False
    for n, name in enumerate(bars.series):
        along = np.arange(count, dtype=np.float64) + thick * (n - 0.5 * (len(bars.series) - 1))
        parts = (bars.series, bars.spread, bars.low, bars.high, bars.published)
        length, spread, low, high, published = (series_values(part, name, count) for part in parts)
        bar = axes.barh if horizontal else axes.bar
        bar(along, length, 0.94 * thick, label=name, **_bar_style(colour_indices[name]))
        line = axes.hlines if horizontal else axes.vlines
        line(along, np.maximum(length - spread, 0.0), length + spread, color=FAINT, linewidth=0.9)
        line(along, low, high, color=INK, linewidth=1.3)
        for end in (low, high):
            at = (end, along) if horizontal else (along, end)
            axes.plot(*at, "|" if horizontal else "_", color=INK, markersize=6, markeredgewidth=1.3)
        if _has_numbers(bars):
            tips = np.maximum(np.nan_to_num(np.fmax.reduce([length, length + spread, high, published])), 0.0)
            for place, value, tip, is_published in zip(along, length, tips, tips == published, strict=True):
                text = format_number(float(value), bars.unit) if np.isfinite(value) else "–"
                _draw_number(axes, text, place, tip, 10 if is_published else 4, horizontal)
        if np.isfinite(published).any():
            diamonds.append((published, along) if horizontal else (along, published))
        has_negative |= bool(np.nanmin(length, initial=0.0) < 0.0)
    for n, at in enumerate(diamonds):
        label = None if n else "published"
        axes.plot(*at, "D", color=PAPER, markeredgecolor=INK, markersize=6, label=label, zorder=4)
    if has_negative:
        (axes.axvline if horizontal else axes.axhline)(0.0, color=INK, linewidth=0.8)
    _label_axes(axes, bars, horizontal)
    if len(bars.series) > 1 or has_values(bars.published):
        add_legend(figure, axes)


def height_in(bars: BarChart) -> float:
    """Height of the chart [in]."""
    bar_in = _BAR_IN if _has_numbers(bars) else _THIN_IN
    horizontal_in = _FRAME_IN + len(bars.groups) * (_GROUP_IN + bar_in * max(len(bars.series), 1))
    return max(horizontal_in, 1.6) if is_horizontal(bars) else _VERTICAL_IN


def is_horizontal(bars: BarChart) -> bool:
    """Whether bars are horizontal: on request, if there are many, or if their names are too long to stand below."""
    room = max(_LETTERS // max(len(bars.groups), 1), 1)
    rows = [textwrap.wrap(group, room, break_long_words=False) for group in bars.groups]
    too_long = any(len(lines) > _MOST_ROWS or max(map(len, lines), default=0) > room for lines in rows)
    return bars.horizontal or too_long or len(bars.groups) * len(bars.series) > _MOST_VERTICAL


def explain_signs(bars: BarChart) -> str:
    """Sentences that explain the marks that the chart has."""
    signs: dict[str, SeriesValues] = {
        "Whiskers: 95 % interval.": bars.high,
        "Thin grey lines: standard deviation over units.": bars.spread,
        "Diamonds: published values.": bars.published,
    }
    sentences = [text for text, values in signs.items() if has_values(values)]
    absent = any(value is None for values in bars.series.values() for value in values)
    return " ".join([*sentences, *(["A dash: not measured."] if absent else [])])


def has_values(values: SeriesValues) -> bool:
    """Whether any series has a value."""
    return any(value is not None for row in values.values() for value in row)


def _has_numbers(bars: BarChart) -> bool:
    """Whether each bar has room for its number; otherwise only the table has them."""
    return len(bars.groups) * len(bars.series) <= (_MOST_HORIZONTAL_NUMBERED if is_horizontal(bars) else _MOST_NUMBERED)


def _bar_style(n: int) -> dict[str, Any]:
    """Colour of the n-th series; those beyond the last colour are grey and differ in their hatches."""
    hatch = _HATCHES[max(n - len(COLOURS), 0) % len(_HATCHES)] or None
    return {"color": series_colour(n), "hatch": hatch, "edgecolor": PAPER, "linewidth": 0.6}


def _draw_number(axes: Axes, text: str, along: float, tip: float, off: int, horizontal: bool) -> None:
    """Write the value of a bar beyond its tip."""
    axes.annotate(
        text,
        (tip, along) if horizontal else (along, tip),
        xytext=(off, 0) if horizontal else (0, off),
        textcoords="offset points",
        ha="left" if horizontal else "center",
        va="center_baseline" if horizontal else "bottom",
        fontsize=9.5,
        color=INK,
    )


def _label_axes(axes: Axes, bars: BarChart, horizontal: bool) -> None:
    middles = np.arange(len(bars.groups))
    letters = _HORIZONTAL_LETTERS if horizontal else _LETTERS // max(len(bars.groups), 1)
    names = [textwrap.fill(group, letters) for group in bars.groups]
    label = "error [deg]" if bars.unit == "deg" else bars.unit
    if horizontal:
        axes.set_yticks(middles, names)
        axes.set_ylim(len(middles) - 0.45, -0.55)
        axes.set_xlabel(label)
        axes.margins(x=0.12)
    else:
        axes.set_xticks(middles, names)
        axes.set_ylabel(label)
        axes.margins(y=0.12)
    axes.grid(False, axis="y" if horizontal else "x")
    axes.tick_params(axis="y" if horizontal else "x", length=0)


_MOST_NAMED = 10
"""Most lines that have their names at their ends; more lines have a legend."""
_MOST_MARKERS = 25
"""About the most points of a line that are marked."""


def draw_lines(figure: Figure, lines: LineChart, colour_indices: Mapping[str, int]) -> None:
    """Draw the chart; `colour_indices` gives each series the index of its colour. Gaps stay open."""
    from matplotlib.ticker import MaxNLocator

    axes = figure.subplots()
    ends = []
    for name in lines.series:
        style = series_style(colour_indices[name])
        x, values = decimate(np.array(lines.x, dtype=float), series_values(lines.series, name, len(lines.x)))
        every = max(1, len(x) // _MOST_MARKERS)
        axes.plot(x, values, markevery=every, markersize=3.5, label=name, **style)
        finite = values[np.isfinite(values)]
        if len(finite):
            ends.append((float(finite[-1]), name, style["color"]))
    axes.set_xlabel(lines.x_label)
    axes.set_ylabel(lines.y_label)
    axes.margins(x=0.0)
    if len(lines.x) <= _MOST_MARKERS and all(x == int(x) for x in lines.x):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    heights = [value for values in lines.series.values() for value in values if value is not None]
    if heights and 0.0 <= min(heights) < 0.5 * max(heights):
        axes.set_ylim(bottom=0.0)
    if len(ends) <= _MOST_NAMED:
        label_line_ends(axes, ends)
    else:
        add_legend(figure, axes)
