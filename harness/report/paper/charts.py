"""The figures of a paper's page as charts, tables and alternative texts; a method has one colour in all charts."""

from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from itertools import count

import numpy as np

from harness.core.number_format import NOT_MEASURED, Interval, format_number
from harness.report.kit.chart import draw_chart
from harness.report.kit.page import DataTable
from harness.report.kit.style import Chart, Figure
from harness.report.kit.text import to_file_name
from harness.report.paper.figures import draw_bars, draw_lines, explain_signs, height_in, value_at
from harness.results.findings import BarChart, LineChart, PaperExperiment, PaperFindings

_MOST_IN_ALT_TEXT = 12
"""Most numbers in an alternative text; with more of them it refers to the table."""


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
    named = [(row[0], zip(table.head[1:], row[1:], strict=True)) for row in table.rows]
    bars = [f"{group}: {', '.join(f'{column} {text}' for column, text in cells)}" for group, cells in named]
    return f"{start}. {'; '.join(bars)}."


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
    value, spread, low, high = (value_at(part, name, n) for part in (bars.series, bars.spread, bars.low, bars.high))
    if low is None or high is None or value is None:
        text = _format_value(value, bars.unit)
        return text if value is None or spread is None else f"{text} ± {_format_value(spread, bars.unit)}"
    number = Interval.of(value, low, high)
    return (
        f"{number.number} ± {_format_value(spread, bars.unit)} ({number.ends})" if spread is not None else str(number)
    )


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


_LINES_IN = 3.4
"""Height of a line chart [in]."""


def figure_charts(findings: PaperFindings, experiment: PaperExperiment) -> list[Callable[[], Chart | None]]:
    """Functions that draw the figures of an experiment; None is drawn of a figure without any measured value."""
    names = Counter(name for e in findings.experiments for figure in e.figures for name in figure.series)
    shared = {name: n for n, name in enumerate(name for name, figures in names.items() if figures > 1)}
    name = to_file_name(experiment.name)
    return [
        partial(_chart, f"{name}_{n}", figure, _colour_indices(figure, shared))
        for n, figure in enumerate(experiment.figures, start=1)
    ]


def _colour_indices(figure: BarChart | LineChart, shared: Mapping[str, int]) -> dict[str, int]:
    """Series -> index of its colour: fixed for series of several figures, the remaining ones for the others."""
    taken = {name: shared[name] for name in figure.series if name in shared}
    free = (n for n in count() if n not in taken.values())
    return {name: taken[name] if name in taken else next(free) for name in figure.series}


def _chart(name: str, content: BarChart | LineChart, colours: Mapping[str, int]) -> Chart | None:
    if not is_measured(content):
        return None

    def draw(figure: Figure) -> None:
        if isinstance(content, LineChart):
            draw_lines(figure, content, colours)
        else:
            draw_bars(figure, content, colours)

    caption, height = content.caption, _LINES_IN
    if isinstance(content, BarChart):
        caption, height = f"{caption} {explain_signs(content)}".strip(), height_in(content)
    return draw_chart(name, content.title, caption, alt_text(content), draw, height, raster=True)
