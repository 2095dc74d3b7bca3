"""Legends show every name in full and have no more rows than needed."""

from collections.abc import Sequence

import pytest
from matplotlib.figure import Figure

from harness.experiment.scenarios import load_scenario
from harness.report.kit.chart import add_legend, draw_chart

LONG = load_scenario("boxing_outliers").methods
ALL = load_scenario("boxing").methods
LONGER = [f"{name} (pos+torso_ori, split sequence, new performer)" for name in LONG]


@pytest.mark.parametrize("names", [ALL[:3], ALL, LONG, LONGER, ["x" * 90], []])
def test_a_legend_stays_on_its_chart_and_leaves_the_axes_their_height(names: Sequence[str]) -> None:
    made: list[Figure] = []

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for name in names:
            axes.plot([0.0, 1.0], label=name)
        add_legend(figure, axes)
        made.append(figure)

    draw_chart("chart", "", "", "", draw, 3.0)
    (figure,) = made
    (box,) = (shown.get_window_extent() for shown in figure.legends)
    assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1
    assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1
    assert figure.axes[0].get_window_extent().height / figure.dpi >= 1.9
    if names == ALL[:3] or not names:
        assert figure.get_figheight() == 3.0
