"""A figure in words: its numbers as a table, for those who cannot see it and for when nothing can draw it."""

from collections.abc import Mapping, Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.report.paper.verdicts import MINUS
from harness.report.run.tables import format_number
from harness.results.findings import BarChart, FindingsTable, LineChart

NOT_MEASURED = "not measured"
_MOST_IN_ALT_TEXT = 12
"""Numbers in an alternative text; with more of them the table is the better way."""
SeriesValues = Mapping[str, Sequence[float | None]]


def figure_table(figure: BarChart | LineChart) -> FindingsTable:
    """Of bars every one, of lines what sums them up."""
    return _bar_table(figure) if isinstance(figure, BarChart) else _line_table(figure)


def is_measured(figure: BarChart | LineChart) -> bool:
    """Whether there is anything to draw."""
    return any(value is not None for values in figure.series.values() for value in values)


def alt_text(figure: BarChart | LineChart) -> str:
    """What a reader who cannot see the figure is told."""
    table = figure_table(figure)
    if isinstance(figure, LineChart):
        means = [f"{row[0]} {row[1]}" for row in table.rows]
        return f"{figure.title}: {figure.y_label} over {figure.x_label}; means: {', '.join(means)}."
    said = f"{figure.title}: bars of {', '.join(figure.series)} in {figure.unit}"
    if len(figure.groups) * len(figure.series) > _MOST_IN_ALT_TEXT:
        return f"{said} for {len(figure.groups)} groups; the table after it has the numbers."
    bars = [f"{row[0]}: {', '.join(map(_label_value, table.columns[1:], row[1:]))}" for row in table.rows]
    return f"{said}. {'; '.join(bars)}."


def value_at(values: SeriesValues, series: str, n: int) -> float | None:
    """Of the n-th group; None where nothing was measured, or there is no such series."""
    found = values.get(series, ())
    return found[n] if n < len(found) else None


def format_with_minus(value: float, unit: str) -> str:
    """With the decimals that suit the unit, and no zero below zero."""
    text = format_number(float(value), unit)
    return (text if text.strip("-0.") else text.strip("-")).replace("-", MINUS)


def series_values(values: SeriesValues, series: str, count: int) -> Floats:
    """(count,) of one series, NaN where nothing was measured."""
    found = [value_at(values, series, n) for n in range(count)]
    return np.array([np.nan if value is None else value for value in found], dtype=float)


def _label_value(column: str, text: str) -> str:
    return f"{column} {text}"


def _bar_table(bars: BarChart) -> FindingsTable:
    published = [name for name in bars.series if any(v is not None for v in bars.published.get(name, ()))]
    columns = ("", *bars.series, *(f"{name}, published" if len(bars.series) > 1 else "published" for name in published))
    rows: list[tuple[str, ...]] = []
    for n, group in enumerate(bars.groups if is_measured(bars) else ()):
        ours = [_bar_cell(bars, name, n) for name in bars.series]
        theirs = [_format_value(value_at(bars.published, name, n), bars.unit, "") for name in published]
        rows.append((group, *ours, *theirs))
    return FindingsTable(f"{bars.title} [{bars.unit}]", columns, tuple(rows))


def _bar_cell(bars: BarChart, name: str, n: int) -> str:
    """The value, its standard deviation and its interval."""
    value, spread = value_at(bars.series, name, n), value_at(bars.spread, name, n)
    low, high = value_at(bars.low, name, n), value_at(bars.high, name, n)
    text = _format_value(value, bars.unit)
    if value is not None and spread is not None:
        text += f" ± {_format_value(spread, bars.unit)}"
    if value is not None and low is not None and high is not None:
        text += f" ({_format_value(low, bars.unit)} to {_format_value(high, bars.unit)})"
    return text


def _line_table(lines: LineChart) -> FindingsTable:
    columns = ("", "mean", "median", "95th percentile", "largest", "points")
    rows: list[tuple[str, ...]] = []
    for name, values in (lines.series if is_measured(lines) else {}).items():
        known = np.array([value for value in values if value is not None], dtype=float)
        figures = [known.mean(), *np.quantile(known, [0.5, 0.95, 1.0])] if len(known) else [None] * 4
        rows.append((name, *(_format_value(value, "") for value in figures), f"{len(known):,} of {len(lines.x):,}"))
    return FindingsTable(f"{lines.title}: {lines.y_label}", columns, tuple(rows))


def _format_value(value: float | None, unit: str, absent: str = NOT_MEASURED) -> str:
    return absent if value is None else format_with_minus(value, unit)
