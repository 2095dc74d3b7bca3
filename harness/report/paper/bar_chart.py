"""Bar charts of a paper's page, horizontal or vertical: values, intervals, standard deviations, published values."""

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import format_number
from harness.report.kit.chart import add_legend
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Axes, Figure, series_colour
from harness.report.paper.figure_table import SeriesValues, series_values
from harness.results.findings import BarChart

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


@dataclass(frozen=True)
class _BarSeries:
    """One series of G groups: (G,) positions of its bars and the values drawn there; NaN where there is none."""

    name: str
    along: Floats
    length: Floats
    spread: Floats
    low: Floats
    high: Floats
    published: Floats

    @property
    def tips(self) -> Floats:
        """(G,) the largest value that is drawn at each bar."""
        out: Floats = np.fmax.reduce([self.length, self.length + self.spread, self.high, self.published])
        return np.maximum(np.nan_to_num(out), 0.0)


def draw_bars(figure: Figure, bars: BarChart, colour_indices: Mapping[str, int]) -> None:
    """Draw the chart; `colour_indices` gives each series the index of its colour."""
    axes, horizontal = figure.subplots(), is_horizontal(bars)
    thick = _GROUP / max(len(bars.series), 1)
    rows = _bar_series(bars, thick)
    for row in rows:
        bar = axes.barh if horizontal else axes.bar
        bar(row.along, row.length, 0.94 * thick, label=row.name, **_bar_style(colour_indices[row.name]))
        _draw_whiskers(axes, row, horizontal)
        if _has_numbers(bars):
            _draw_numbers(axes, row, bars.unit, horizontal)
    _draw_published(axes, rows, horizontal)
    if any(np.nanmin(row.length, initial=0.0) < 0.0 for row in rows):
        (axes.axvline if horizontal else axes.axhline)(0.0, color=INK, linewidth=0.8)
    _label_axes(axes, bars, horizontal)
    if len(rows) > 1 or has_values(bars.published):
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


def _bar_series(bars: BarChart, thick: float) -> list[_BarSeries]:
    count, middle = len(bars.groups), 0.5 * (len(bars.series) - 1)
    parts = (bars.series, bars.spread, bars.low, bars.high, bars.published)
    places = np.arange(count, dtype=np.float64)
    return [
        _BarSeries(name, places + thick * (n - middle), *(series_values(part, name, count) for part in parts))
        for n, name in enumerate(bars.series)
    ]


def _bar_style(n: int) -> dict[str, Any]:
    """Colour of the n-th series; those beyond the last colour are grey and differ in their hatches."""
    hatch = _HATCHES[max(n - len(COLOURS), 0) % len(_HATCHES)] or None
    return {"color": series_colour(n), "hatch": hatch, "edgecolor": PAPER, "linewidth": 0.6}


def _draw_whiskers(axes: Axes, row: _BarSeries, horizontal: bool) -> None:
    """Draw standard deviations as thin lines and intervals with caps."""
    line = axes.hlines if horizontal else axes.vlines
    line(row.along, np.maximum(row.length - row.spread, 0.0), row.length + row.spread, color=FAINT, linewidth=0.9)
    line(row.along, row.low, row.high, color=INK, linewidth=1.3)
    for end in (row.low, row.high):
        at = (end, row.along) if horizontal else (row.along, end)
        axes.plot(*at, "|" if horizontal else "_", color=INK, markersize=6, markeredgewidth=1.3)


def _draw_numbers(axes: Axes, row: _BarSeries, unit: str, horizontal: bool) -> None:
    """Write the value of every bar beyond its tip, and a dash for a missing bar."""
    for along, value, tip, published in zip(row.along, row.length, row.tips, row.published, strict=True):
        off = 10 if tip == published else 4
        axes.annotate(
            format_number(float(value), unit) if np.isfinite(value) else "–",
            (tip, along) if horizontal else (along, tip),
            xytext=(off, 0) if horizontal else (0, off),
            textcoords="offset points",
            ha="left" if horizontal else "center",
            va="center_baseline" if horizontal else "bottom",
            fontsize=8,
            color=INK,
        )


def _draw_published(axes: Axes, rows: list[_BarSeries], horizontal: bool) -> None:
    """Draw a diamond at each published value, with one entry in the legend."""
    label: str | None = "published"
    for row in rows:
        if np.isfinite(row.published).any():
            at = (row.published, row.along) if horizontal else (row.along, row.published)
            axes.plot(*at, "D", color=PAPER, markeredgecolor=INK, markersize=6, label=label, zorder=4)
            label = None


def _label_axes(axes: Axes, bars: BarChart, horizontal: bool) -> None:
    middles = np.arange(len(bars.groups))
    letters = _HORIZONTAL_LETTERS if horizontal else _LETTERS // max(len(bars.groups), 1)
    names = [textwrap.fill(group, letters) for group in bars.groups]
    if horizontal:
        axes.set_yticks(middles, names)
        axes.set_ylim(len(middles) - 0.45, -0.55)
        axes.set_xlabel(bars.unit)
        axes.margins(x=0.12)
    else:
        axes.set_xticks(middles, names)
        axes.set_ylabel(bars.unit)
        axes.margins(y=0.12)
    axes.grid(False, axis="y" if horizontal else "x")
    axes.tick_params(axis="y" if horizontal else "x", length=0)
