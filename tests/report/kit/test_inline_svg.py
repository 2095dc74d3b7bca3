"""Charts inside a page: references still work, ids do not collide, titles are escaped, scales are those of the axes."""

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest

from harness.report.kit.chart import draw_chart
from harness.report.kit.document import chart_figure
from harness.report.kit.inline_svg import inline_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _draw(figure: "Figure") -> None:
    axes = figure.subplots()
    axes.plot([1.0, 2.0, 4.0], [10.0, 100.0, 1000.0], "o-", label="a <b>", gid="dot")
    axes.plot([1.0, 4.0], [20.0, 20.0], label="_unnamed")
    axes.set_yscale("log")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("error [deg]")
    figure.legend(*axes.get_legend_handles_labels())


def test_ids_that_are_referred_to_stay_and_others_go() -> None:
    svg = draw_chart("one", "", "", "", _draw, 3.0).for_screen()
    text = inline_svg(svg, "alternative & text", {})
    assert text.startswith('<svg role="group" aria-label="alternative &amp; text"')
    ids = re.findall(r' id="([^"]*)"', text)
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', text))
    assert used
    assert set(ids) == used
    assert len(ids) == len(set(ids))
    assert "<metadata" not in text
    assert not re.search(r'\bd="[^"]*\.\d{3}', text)


def test_titles_are_set_as_text() -> None:
    svg = draw_chart("two", "", "", "", _draw, 3.0).svg
    assert "<g><title>1 &lt; 2 deg</title>" in inline_svg(svg, "", {"dot": "1 < 2 deg"})


def test_a_chart_to_point_at_has_the_scales_of_its_axes() -> None:
    chart = draw_chart("three", "", "", "", _draw, 3.0, hover=True)
    assert chart.lines is not None
    assert chart.lines["names"] == ["a <b>"]
    (plot,) = chart.lines["plots"]
    assert (plot["x"]["log"], plot["y"]["log"]) == (False, True)
    assert (plot["x"]["unit"], plot["y"]["unit"]) == ("s", "deg")
    found = re.search(r'id="data:series=0,plot=0">\s*<path d="([^"]*)"', chart.svg)
    assert found is not None
    points = np.array(re.findall(r"[ML] ([\d.]+) ([\d.]+)", found[1]), dtype=float)
    left, top, right, bottom = plot["box"]
    x = np.interp(points[:, 0], [left, right], plot["x"]["limits"])
    y = np.exp(np.interp(points[:, 1], [top, bottom], np.log(plot["y"]["limits"][::-1])))
    np.testing.assert_allclose(x, [1.0, 2.0, 4.0], rtol=1e-3)
    np.testing.assert_allclose(y, [10.0, 100.0, 1000.0], rtol=1e-3)


@pytest.mark.parametrize("hover", [True, False])
def test_a_chart_is_inline_only_if_it_answers_to_the_pointer(hover: bool) -> None:
    figure = chart_figure(draw_chart("four", "title", "", "alt", _draw, 3.0, hover=hover))
    assert ("<svg" in figure) is hover
    assert ("data:image/svg+xml" in figure) is not hover
    assert ("data-hover=" in figure) is hover
