"""The charts of a paper's page, one for each figure; a method has the same colour in all of them."""

from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from itertools import count

from harness.report.kit.chart import draw_chart
from harness.report.kit.style import Chart, Figure
from harness.report.kit.text import to_file_name
from harness.report.paper.bar_chart import draw_bars, explain_signs, height_in
from harness.report.paper.figure_table import alt_text, is_measured
from harness.report.paper.line_chart import draw_lines
from harness.results.findings import BarChart, LineChart, PaperExperiment, PaperFindings

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
