"""Drawing of charts: one figure to SVG and PNG, legends and line labels that do not collide, thinning of long lines."""

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from harness.core.arrays import Floats
from harness.core.progress import report_step
from harness.core.working_folder import plain_import
from harness.report.kit.inline_svg import describe_plots, mark_series
from harness.report.kit.style import INK, SETTINGS, Axes, Chart, Figure, legend_scale, to_png, to_svg

_WIDTH_IN = 7.6
"""Width of a chart as wide as the page [in]."""
_LETTERS, _HANDLE_LETTERS, _ROW_IN = 93, 9, 0.2
"""Legend sizes: width of the page and of a line's sign with margins [average letters]; height of a row [in]."""
_MOST_POINTS = 1500
"""Points of one line; more do not look sharper on a screen."""
_LABEL_HEIGHT = 0.06
"""Height of a name at the end of a line, as a share of the axes' height."""
_LABEL_LETTERS = 40
"""Letters of such a name."""


def draw_chart(
    name: str,
    title: str,
    caption: str,
    alt: str,
    draw: Callable[[Figure], None],
    height_in: float,
    *,
    width_in: float = _WIDTH_IN,
    layout: Literal["constrained"] | None = "constrained",
    raster: bool = False,
    hover: bool = False,
    titles: Mapping[str, str] | None = None,
) -> Chart:
    """The chart that `draw` draws on an empty figure; `raster` adds a PNG to the SVG.

    Without a layout the axes stay where `draw` puts them, which is faster. With `hover` a page shows the values of
    lines under the pointer and switches them off in the legend. `titles` are shown under the pointer too: gid of an
    element -> text.
    """
    report_step(title)
    with plain_import():
        import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    with matplotlib.rc_context(SETTINGS):
        figure = Figure(figsize=(width_in, height_in))
        draw(figure)
        if layout and figure.axes:  # not as the figure's engine, with which matplotlib draws everything twice
            ConstrainedLayoutEngine().execute(figure)
        names = mark_series(figure) if hover else []
        svg = to_svg(figure, name)
        lines = {"names": names, "plots": describe_plots(figure)} if hover else None
        return Chart(name, title, caption, alt, svg, to_png(figure) if raster else b"", lines, titles or {})


def clear_plots(folder: Path) -> Path:
    """Make FOLDER/plots, delete the charts of an earlier report in it, and return it."""
    plots = folder / "plots"
    plots.mkdir(exist_ok=True)
    for old in (*plots.glob("*.svg"), *plots.glob("*.png")):
        old.unlink()
    return plots


def add_legend(figure: Figure, axes: Axes) -> None:
    """Name the lines of `axes` above the chart; the figure grows by the rows beyond the first."""
    handles, names = axes.get_legend_handles_labels()
    scale = legend_scale()
    room, row_in = _LETTERS * figure.get_figwidth() / _WIDTH_IN / scale, _ROW_IN * scale
    names = [textwrap.fill(name, int(room) - _HANDLE_LETTERS) for name in names]
    columns = next((n for n in range(len(names), 1, -1) if _legend_letters(names, n) <= room), 1)
    figure.legend(handles, names, loc="outside upper left", ncols=columns)
    further_rows = max(math.ceil(len(names) / columns) - 1, 0) + sum(name.count("\n") for name in names)
    figure.set_figheight(figure.get_figheight() + row_in * further_rows)


def _legend_letters(names: Sequence[str], columns: int) -> int:
    """Width of a legend in average letters; matplotlib fills one column after another."""
    return sum(_HANDLE_LETTERS + max(map(len, part)) for part in np.array_split(np.array(names, object), columns))


def decimate(x: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Every n-th point of a long line, so that about 1,500 points remain."""
    every = max(1, len(x) // _MOST_POINTS)
    return x[::every], values[::every]


def insert_gaps(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """The curve with a NaN wherever frames are missing, so that no line is drawn across the gap."""
    step_s = np.diff(time_s)
    gaps = np.flatnonzero(step_s > 1.5 * np.min(step_s, initial=np.inf)) + 1
    return np.insert(time_s, gaps, time_s[gaps - 1]), np.insert(values, gaps, np.nan)


def spread_positions(wanted: Sequence[float], gap: float) -> list[float]:
    """Rising positions at least `gap` apart, as near as possible to the wanted ones, which rise too.

    Least squares by pooling adjacent violators. If the last position would exceed 1, all are moved down together.
    """
    blocks: list[list[float]] = []
    for n, value in enumerate(wanted):
        blocks.append([value - gap * n])
        while len(blocks) > 1 and np.mean(blocks[-2]) > np.mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1].extend(last)
    level = [float(np.mean(block)) for block in blocks for _ in block]
    positions = [value + gap * n for n, value in enumerate(level)]
    too_high = max(positions[-1] - 1.0, 0.0) if positions else 0.0
    return [position - too_high for position in positions]


def label_line_ends(axes: Axes, ends: Sequence[tuple[float, str, str]]) -> None:
    """Write each line's name to the right of its end, with a leader in its colour; names are moved apart.

    `ends` are the last value, name and colour of each line.
    """
    low, high = axes.get_ylim()
    ends = sorted(ends)
    starts = [(value - low) / (high - low) for value, *_ in ends]
    inside = axes.transAxes
    for start, height, (_, name, colour) in zip(starts, spread_positions(starts, _LABEL_HEIGHT), ends, strict=True):
        axes.annotate(
            textwrap.shorten(name, _LABEL_LETTERS, placeholder="…"),
            (1.0, start),
            (1.04, height),
            xycoords=inside,
            textcoords=inside,
            va="center",
            color=INK,
            fontsize=9.5,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 2.0, "shrinkA": 2.0, "shrinkB": 0.0},
            annotation_clip=False,
        )
