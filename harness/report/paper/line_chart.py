"""Lines of a paper's page: errors over time, each line with its name at its end."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from harness.report.kit.style import INK, line_style
from harness.report.paper.figure_table import series_values
from harness.report.run.charts import add_legend, decimate
from harness.results.findings import LineChart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NAME_HEIGHT = 0.06
"""Of a name at the end of a line, as a share of the axes' height."""
_MOST_NAMED, _LETTERS = 10, 40
"""Lines that have their names at their ends, more have a legend; letters of such a name."""
_MOST_MARKERS = 25
"""Points of a line that are few enough to be seen one by one."""


def draw_lines(canvas: "Figure", lines: LineChart, places: Mapping[str, int]) -> None:
    """The whole chart; `places` says which colour each series has. Nothing is drawn across gaps."""
    from matplotlib.ticker import MaxNLocator

    axes = canvas.subplots()
    ends = []
    for name in lines.series:
        style = line_style(places[name])
        x, values = decimate(np.array(lines.x, dtype=float), series_values(lines.series, name, len(lines.x)))
        marker = "o" if len(x) <= _MOST_MARKERS else None
        axes.plot(x, values, marker=marker, markersize=3.5, label=name, **style)
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
        add_legend(canvas, axes)


def spread_positions(wanted: Sequence[float], gap: float) -> list[float]:
    """Rising places with `gap` between neighbours at least, as near as can be to the wanted ones, which rise too.

    Least squares by pooling adjacent violators; all are moved down together if the last would be above 1.
    """
    blocks: list[list[float]] = []
    for n, value in enumerate(wanted):
        blocks.append([value - gap * n])
        while len(blocks) > 1 and np.mean(blocks[-2]) > np.mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1].extend(last)
    level = [float(np.mean(block)) for block in blocks for _ in block]
    places = [value + gap * n for n, value in enumerate(level)]
    too_high = max(places[-1] - 1.0, 0.0) if places else 0.0
    return [place - too_high for place in places]


def label_line_ends(axes: "Axes", ends: Sequence[tuple[float, str, str]]) -> None:
    """Each name right of its line's end, led to by its colour, moved apart where they would meet.

    `ends` are the last value, name and colour of each line.
    """
    low, high = axes.get_ylim()
    ends = sorted(ends)
    starts = [(value - low) / (high - low) for value, *_ in ends]
    inside = axes.transAxes
    for start, place, (_, name, colour) in zip(starts, spread_positions(starts, _NAME_HEIGHT), ends, strict=True):
        axes.annotate(
            textwrap.shorten(name, _LETTERS, placeholder="…"),
            (1.0, start),
            (1.04, place),
            xycoords=inside,
            textcoords=inside,
            va="center",
            color=INK,
            fontsize=9.5,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 2.0, "shrinkA": 2.0, "shrinkB": 0.0},
            annotation_clip=False,
        )
