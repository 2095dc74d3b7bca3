"""Charts and figures as they are drawn, for looks at their parts, and checks that each must pass."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import matplotlib
import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.collections import Collection, LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from harness.core.arrays import Floats
from harness.report.figures.print_figure import MM_PER_IN, PrintFigure
from harness.report.kit.page import Drawing, Page
from harness.report.kit.style import PRINT_SETTINGS, to_svg


def texts_apart(figure: Figure) -> None:
    """Assert that no tick label, note or legend entry overlaps another, and that all lie inside the figure."""
    figure.draw_without_rendering()  # sizes were those of the file that it was written to
    texts = [text for axes in figure.axes for text in (*_ticks(axes.xaxis), *_ticks(axes.yaxis), *axes.texts)]
    texts += [text for legend in figure.legends for text in legend.get_texts()]
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text()]
    assert len(boxes) > 5
    for n, (text, box) in enumerate(boxes):
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, text
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1, text
        assert [other for other, place in boxes[n + 1 :] if box.overlaps(place)] == [], text


def _ticks(axis: Axis) -> list[Text]:
    """The tick labels that are drawn: those within the limits, and of axes that share a scale those of one."""
    low, high = sorted(axis.get_view_interval())
    labels = [tick.label1 for tick in axis.get_major_ticks() if low <= float(tick.get_loc()) <= high]
    return [label for label in labels if label.get_visible()]


def drawn_figures(draw: Callable[[], object]) -> dict[str, Figure]:
    """Name of each chart that a function draws -> its figure."""
    figures: dict[str, Figure] = {}

    def keep(figure: Figure, name: str) -> str:
        figures[name] = figure
        return to_svg(figure, name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.report.kit.chart.to_svg", keep)
        draw()
    return figures


def points(line: Line2D) -> tuple[Floats, Floats]:
    """The coordinates of a line."""
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


def draw_page(page: Page) -> None:
    """Draw every chart of a page."""
    for section in page.sections:
        for block in section.blocks:
            if isinstance(block, Drawing) and callable(block.chart):
                block.chart()


def spans(collections: Iterable[Collection], axis: int) -> list[tuple[float, float]]:
    """The ends of the first line of each collection, as `hlines` (axis 0) and `vlines` (axis 1) draw them."""
    found = []
    for collection in collections:
        assert isinstance(collection, LineCollection)
        start, end = collection.get_segments()[0][:, axis]
        found.append((float(start), float(end)))
    return found


@contextmanager
def drawn(figure: PrintFigure, width_mm: int = 85) -> Iterator[Figure]:
    """The figure as it is written to a file, for looks at its parts."""
    with matplotlib.rc_context(PRINT_SETTINGS):
        made = Figure(figsize=(width_mm / MM_PER_IN, figure.height_mm / MM_PER_IN), layout="constrained")
        figure.draw(made)
        made.draw_without_rendering()
        yield made
