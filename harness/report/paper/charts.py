"""The charts of a paper's page: one for each figure, a method in one colour throughout."""

from collections import Counter
from collections.abc import Mapping
from itertools import count

from harness.report.kit.style import Chart
from harness.report.paper.bar_chart import draw_bars, explain_signs, height_in
from harness.report.paper.figure_table import alt_text, is_measured
from harness.report.paper.line_chart import draw_lines
from harness.report.run.charts import draw_chart
from harness.report.run.data import to_file_name
from harness.results.findings import BarChart, LineChart, PaperFindings

_LINES_IN = 3.4


def charts(findings: PaperFindings) -> dict[str, list[Chart | None]]:
    """Name of the experiment -> its figures, None for one of which nothing was measured."""
    names = Counter(name for e in findings.experiments for figure in e.figures for name in figure.series)
    shared = {name: place for place, name in enumerate(name for name, figures in names.items() if figures > 1)}
    return {
        experiment.name: [
            _chart(f"{to_file_name(experiment.name)}_{n}", figure, _colour_indices(figure, shared))
            if is_measured(figure)
            else None
            for n, figure in enumerate(experiment.figures, start=1)
        ]
        for experiment in findings.experiments
    }


def _colour_indices(figure: BarChart | LineChart, shared: Mapping[str, int]) -> dict[str, int]:
    """Series -> which colour: what several figures draw has one for the whole page, the others what is left."""
    taken = {name: shared[name] for name in figure.series if name in shared}
    free = (place for place in count() if place not in taken.values())
    return {name: taken[name] if name in taken else next(free) for name in figure.series}


def _chart(name: str, figure: BarChart | LineChart, places: Mapping[str, int]) -> Chart:
    title, alt = figure.title, alt_text(figure)
    if isinstance(figure, LineChart):
        return draw_chart(
            name, title, figure.caption, alt, lambda canvas: draw_lines(canvas, figure, places), _LINES_IN, raster=True
        )
    caption = f"{figure.caption} {explain_signs(figure)}".strip()
    return draw_chart(
        name, title, caption, alt, lambda canvas: draw_bars(canvas, figure, places), height_in(figure), raster=True
    )
