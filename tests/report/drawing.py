"""Checks that every small chart must pass."""

from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text


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
