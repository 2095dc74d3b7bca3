"""The numbers of a figure as a table and as alternative text, for readers without the picture."""

from collections.abc import Mapping, Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import NOT_MEASURED, format_number
from harness.report.kit.page import DataTable
from harness.results.findings import BarChart, LineChart

_MOST_IN_ALT_TEXT = 12
"""Most numbers in an alternative text; with more of them it refers to the table."""
SeriesValues = Mapping[str, Sequence[float | None]]
"""Series -> a value for each group or point; None where nothing was measured."""


def figure_table(figure: BarChart | LineChart) -> DataTable:
    """Every value of a bar chart, or summary statistics of each line of a line chart."""
    return _bar_table(figure) if isinstance(figure, BarChart) else _line_table(figure)


def is_measured(figure: BarChart | LineChart) -> bool:
    """Whether the figure has any value to draw."""
    return any(value is not None for values in figure.series.values() for value in values)


def alt_text(figure: BarChart | LineChart) -> str:
    """Alternative text of the figure for readers who cannot see it."""
    table = figure_table(figure)
    if isinstance(figure, LineChart):
        means = [f"{row[0]} {row[1]}" for row in table.rows]
        return f"{figure.title}: {figure.y_label} over {figure.x_label}; means: {', '.join(means)}."
    start = f"{figure.title}: bars of {', '.join(figure.series)} in {figure.unit}"
    if len(figure.groups) * len(figure.series) > _MOST_IN_ALT_TEXT:
        return f"{start} for {len(figure.groups)} groups; the table after the figure has the numbers."
    bars = [f"{row[0]}: {', '.join(map(_label_value, table.head[1:], row[1:]))}" for row in table.rows]
    return f"{start}. {'; '.join(bars)}."


def value_at(values: SeriesValues, series: str, n: int) -> float | None:
    """Value of a series in the n-th group; None where nothing was measured or the series is missing."""
    row = values.get(series, ())
    return row[n] if n < len(row) else None


def series_values(values: SeriesValues, series: str, count: int) -> Floats:
    """(count,) values of one series, NaN where nothing was measured."""
    row = [value_at(values, series, n) for n in range(count)]
    return np.array([np.nan if value is None else value for value in row], dtype=float)


def _label_value(column: str, text: object) -> str:
    return f"{column} {text}"


def _bar_table(bars: BarChart) -> DataTable:
    published = [name for name in bars.series if any(v is not None for v in bars.published.get(name, ()))]
    columns = ("", *bars.series, *(f"{name}, published" if len(bars.series) > 1 else "published" for name in published))
    rows: list[tuple[str, ...]] = []
    for n, group in enumerate(bars.groups if is_measured(bars) else ()):
        ours = [_bar_cell(bars, name, n) for name in bars.series]
        paper = [_format_value(value_at(bars.published, name, n), bars.unit, "") for name in published]
        rows.append((group, *ours, *paper))
    return DataTable(columns, rows, f"{bars.title} [{bars.unit}]")


def _bar_cell(bars: BarChart, name: str, n: int) -> str:
    """The value with its standard deviation and its interval."""
    value, spread = value_at(bars.series, name, n), value_at(bars.spread, name, n)
    low, high = value_at(bars.low, name, n), value_at(bars.high, name, n)
    text = _format_value(value, bars.unit)
    if value is not None and spread is not None:
        text += f" ± {_format_value(spread, bars.unit)}"
    if value is not None and low is not None and high is not None:
        text += f" ({_format_value(low, bars.unit)} to {_format_value(high, bars.unit)})"
    return text


def _line_table(lines: LineChart) -> DataTable:
    columns = ("", "mean", "median", "95th percentile", "largest", "points")
    rows: list[tuple[str, ...]] = []
    for name, values in (lines.series if is_measured(lines) else {}).items():
        finite = np.array([value for value in values if value is not None], dtype=float)
        figures = [finite.mean(), *np.quantile(finite, [0.5, 0.95, 1.0])] if len(finite) else [None] * 4
        rows.append((name, *(_format_value(value, "") for value in figures), f"{len(finite):,} of {len(lines.x):,}"))
    return DataTable(columns, rows, f"{lines.title}: {lines.y_label}")


def _format_value(value: float | None, unit: str, absent: str = NOT_MEASURED) -> str:
    return absent if value is None else format_number(float(value), unit)
