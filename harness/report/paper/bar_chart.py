"""Bars of a paper's page: lying or standing, with intervals, standard deviations and the paper's own figures."""

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.core.arrays import Floats
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER
from harness.report.paper.figure_table import SeriesValues, format_with_minus, series_values
from harness.report.run.charts import add_legend
from harness.results.findings import BarChart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HATCHES = ("", "////", "....", "xxxx")
"""Change after every round of colours, as dashes of lines do."""
_LETTERS, _HORIZONTAL_LETTERS, _MOST_ROWS = 96, 34, 3
"""Under all standing bars together; before a lying one; rows of letters under a standing one."""
_MOST_VERTICAL, _MOST_NUMBERED, _MOST_HORIZONTAL_NUMBERED = 45, 25, 64
"""Bars side by side; bars that have room for their number at their end, standing and lying."""
_BAR_IN, _THIN_IN, _GROUP_IN, _FRAME_IN, _VERTICAL_IN = 0.15, 0.07, 0.09, 0.75, 3.4
"""Height of a lying bar with its number, without, of the space between groups, of what is around; of standing bars."""
_GROUP = 0.82
"""Of the distance between groups, filled by bars."""


@dataclass(frozen=True)
class _BarSeries:
    """One series: where its bars stand, and everything that is drawn at them; NaN where nothing is known."""

    name: str
    along: Floats
    length: Floats
    spread: Floats
    low: Floats
    high: Floats
    published: Floats

    @property
    def tips(self) -> Floats:
        """How far anything reaches."""
        out: Floats = np.fmax.reduce([self.length, self.length + self.spread, self.high, self.published])
        return np.maximum(np.nan_to_num(out), 0.0)


def draw_bars(canvas: "Figure", bars: BarChart, places: Mapping[str, int]) -> None:
    """The whole chart; `places` says which colour each series has."""
    axes, lying = canvas.subplots(), is_horizontal(bars)
    thick = _GROUP / max(len(bars.series), 1)
    rows = _bar_series(bars, thick)
    for row in rows:
        bar = axes.barh if lying else axes.bar
        bar(row.along, row.length, 0.94 * thick, label=row.name, **_bar_style(places[row.name]))
        _draw_whiskers(axes, row, lying)
        if _has_numbers(bars):
            _draw_numbers(axes, row, bars.unit, lying)
    _draw_published(axes, rows, lying)
    if any(np.nanmin(row.length, initial=0.0) < 0.0 for row in rows):
        (axes.axvline if lying else axes.axhline)(0.0, color=INK, linewidth=0.8)
    _label_axes(axes, bars, lying)
    if len(rows) > 1 or has_values(bars.published):
        add_legend(canvas, axes)


def height_in(bars: BarChart) -> float:
    """Of the chart [in]."""
    bar_in = _BAR_IN if _has_numbers(bars) else _THIN_IN
    lying_in = _FRAME_IN + len(bars.groups) * (_GROUP_IN + bar_in * max(len(bars.series), 1))
    return max(lying_in, 1.6) if is_horizontal(bars) else _VERTICAL_IN


def is_horizontal(bars: BarChart) -> bool:
    """Whether bars lie: asked for, too many, or with names too long to stand under them."""
    room = max(_LETTERS // max(len(bars.groups), 1), 1)
    rows = [textwrap.wrap(group, room, break_long_words=False) for group in bars.groups]
    too_long = any(len(lines) > _MOST_ROWS or max(map(len, lines), default=0) > room for lines in rows)
    return bars.horizontal or too_long or len(bars.groups) * len(bars.series) > _MOST_VERTICAL


def explain_signs(bars: BarChart) -> str:
    """What the signs on the bars mean."""
    signs: dict[str, SeriesValues] = {
        "Whiskers: 95 % interval.": bars.high,
        "Thin grey lines: standard deviation over clips.": bars.spread,
        "Diamonds: published.": bars.published,
    }
    said = [text for text, values in signs.items() if has_values(values)]
    absent = any(value is None for values in bars.series.values() for value in values)
    return " ".join([*said, *(["A dash: not measured."] if absent else [])])


def has_values(values: SeriesValues) -> bool:
    return any(value is not None for row in values.values() for value in row)


def _has_numbers(bars: BarChart) -> bool:
    """Whether each bar's number fits to it; else they are in the table alone."""
    return len(bars.groups) * len(bars.series) <= (_MOST_HORIZONTAL_NUMBERED if is_horizontal(bars) else _MOST_NUMBERED)


def _bar_series(bars: BarChart, thick: float) -> list[_BarSeries]:
    count, middle = len(bars.groups), 0.5 * (len(bars.series) - 1)
    parts = (bars.series, bars.spread, bars.low, bars.high, bars.published)
    places = np.arange(count, dtype=np.float64)
    return [
        _BarSeries(name, places + thick * (n - middle), *(series_values(part, name, count) for part in parts))
        for n, name in enumerate(bars.series)
    ]


def _bar_style(place: int) -> dict[str, Any]:
    """Colour and hatches of the n-th series."""
    hatch = _HATCHES[place // len(COLOURS) % len(_HATCHES)] or None
    return {"color": COLOURS[place % len(COLOURS)], "hatch": hatch, "edgecolor": PAPER, "linewidth": 0.6}


def _draw_whiskers(axes: "Axes", row: _BarSeries, lying: bool) -> None:
    """Standard deviations thin, intervals with caps."""
    line = axes.hlines if lying else axes.vlines
    line(row.along, np.maximum(row.length - row.spread, 0.0), row.length + row.spread, color=FAINT, linewidth=0.9)
    line(row.along, row.low, row.high, color=INK, linewidth=1.3)
    for end in (row.low, row.high):
        at = (end, row.along) if lying else (row.along, end)
        axes.plot(*at, "|" if lying else "_", color=INK, markersize=6, markeredgewidth=1.3)


def _draw_numbers(axes: "Axes", row: _BarSeries, unit: str, lying: bool) -> None:
    """The value of every bar beyond its tip, a dash for a bar that is not there."""
    for along, value, tip, theirs in zip(row.along, row.length, row.tips, row.published, strict=True):
        off = 10 if tip == theirs else 4
        axes.annotate(
            format_with_minus(value, unit) if np.isfinite(value) else "–",
            (tip, along) if lying else (along, tip),
            xytext=(off, 0) if lying else (0, off),
            textcoords="offset points",
            ha="left" if lying else "center",
            va="center_baseline" if lying else "bottom",
            fontsize=8,
            color=INK,
        )


def _draw_published(axes: "Axes", rows: list[_BarSeries], lying: bool) -> None:
    """A diamond where the paper's figure is; one entry in the legend."""
    label: str | None = "published"
    for row in rows:
        if np.isfinite(row.published).any():
            at = (row.published, row.along) if lying else (row.along, row.published)
            axes.plot(*at, "D", color=PAPER, markeredgecolor=INK, markersize=6, label=label, zorder=4)
            label = None


def _label_axes(axes: "Axes", bars: BarChart, lying: bool) -> None:
    middles = np.arange(len(bars.groups))
    letters = _HORIZONTAL_LETTERS if lying else _LETTERS // max(len(bars.groups), 1)
    names = [textwrap.fill(group, letters) for group in bars.groups]
    if lying:
        axes.set_yticks(middles, names)
        axes.set_ylim(len(middles) - 0.45, -0.55)
        axes.set_xlabel(bars.unit)
        axes.margins(x=0.12)
    else:
        axes.set_xticks(middles, names)
        axes.set_ylabel(bars.unit)
        axes.margins(y=0.12)
    axes.grid(False, axis="y" if lying else "x")
    axes.tick_params(axis="y" if lying else "x", length=0)
