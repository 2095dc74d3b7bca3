"""The charts of a paper's page: a colour for each name that holds for the whole page, and one chart for each figure."""

from collections.abc import Mapping

from harness.report.figures import drawn
from harness.report.paper_bars import draw_bars, height_in, key
from harness.report.paper_lines import draw_lines
from harness.report.paper_numbers import alternative
from harness.report.run import file_name
from harness.report.style import Chart
from harness.score.findings import Bars, Findings, Lines

_LINES_IN = 3.4


def charts(findings: Findings) -> dict[str, list[Chart]]:
    """Name of the experiment -> its figures."""
    figures = (figure for experiment in findings.experiments for figure in experiment.figures)
    names = dict.fromkeys(name for figure in figures for name in figure.series)
    places = {name: place for place, name in enumerate(names)}
    return {
        experiment.name: [
            _chart(f"{file_name(experiment.name)}_{n}", figure, places)
            for n, figure in enumerate(experiment.figures, start=1)
        ]
        for experiment in findings.experiments
    }


def _chart(name: str, figure: Bars | Lines, places: Mapping[str, int]) -> Chart:
    title, alt = figure.title, alternative(figure)
    if isinstance(figure, Lines):
        return drawn(
            name, title, figure.caption, alt, lambda canvas: draw_lines(canvas, figure, places), _LINES_IN, raster=True
        )
    caption = f"{figure.caption} {key(figure)}".strip()
    return drawn(
        name, title, caption, alt, lambda canvas: draw_bars(canvas, figure, places), height_in(figure), raster=True
    )
