"""Line charts of a paper's page; each line has its name at its end, or in a legend if there are many."""

from collections.abc import Mapping

import numpy as np

from harness.report.kit.chart import add_legend, decimate, label_line_ends
from harness.report.kit.style import Figure, series_style
from harness.report.paper.figure_table import series_values
from harness.results.findings import LineChart

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
