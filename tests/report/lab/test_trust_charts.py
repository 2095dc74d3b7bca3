"""What the charts of a trust study draw, read off the figures."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from harness.report.kit.style import to_svg
from harness.report.lab.trust_charts import distances_chart, equivalence_chart, pairs_chart, ranks_chart
from harness.results.trust_findings import TrustFindings
from tests.report.drawing import texts_apart
from tests.report.fabricate_trust import ARMS, MEANS, empty_trust, made_up_trust


def figures_of(findings: TrustFindings) -> dict[str, Figure]:
    """Name of the chart -> its figure."""
    figures: dict[str, Figure] = {}

    def keep(figure: Figure, name: str) -> str:
        figures[name] = figure
        return to_svg(figure, name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.report.kit.chart.to_svg", keep)
        for chart in (pairs_chart, ranks_chart, equivalence_chart, distances_chart):
            chart(findings)
    return figures


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    return figures_of(made_up_trust())


def marks(figure: Figure, marker: str) -> list[tuple[float, float]]:
    """Places of the marks of this kind."""
    (axes,) = figure.axes
    lines = [line for line in axes.lines if line.get_marker() == marker]
    return [(float(np.asarray(line.get_xdata()).item()), float(np.asarray(line.get_ydata()).item())) for line in lines]


def test_there_is_a_chart_for_everything_that_was_measured(figures: dict[str, Figure]) -> None:
    assert list(figures) == ["pairs", "ranks", "equivalence", "distances"]
    assert figures_of(empty_trust()) == {}
    without = replace(made_up_trust(), pairs=(), equivalences=made_up_trust().equivalences[:1])
    assert list(figures_of(without)) == ["equivalence", "distances"]


def test_names_and_numbers_do_not_overlap(figures: dict[str, Figure]) -> None:
    for figure in figures.values():
        texts_apart(figure)


def test_a_pair_has_both_sides_in_its_row(figures: dict[str, Figure]) -> None:
    device, simulation = marks(figures["pairs"], "o"), marks(figures["pairs"], "s")
    assert device[0] == pytest.approx((9.1 - 9.8, -0.14))
    assert simulation[0] == pytest.approx((9.3 - 8.4, 0.14))
    assert len(device) == len(simulation) == 6
    (axes,) = figures["pairs"].axes
    verdicts = [text.get_text() for text in axes.texts]
    assert verdicts == ["contradict", "cannot tell", "agree", "agree", "agree", "agree"]
    assert axes.get_xlabel() == "difference in joint angle error [deg]"


def test_methods_stand_at_their_errors_on_both_sides(figures: dict[str, Figure]) -> None:
    assert marks(figures["ranks"], "o") == sorted(MEANS.values())
    (axes,) = figures["ranks"].axes
    assert axes.get_xlim() == axes.get_ylim()
    assert sorted(text.get_text() for text in figures["ranks"].legends[0].get_texts()) == sorted(ARMS)


def test_differences_are_drawn_in_margins(figures: dict[str, Figure]) -> None:
    assert marks(figures["equivalence"], "D") == [pytest.approx((-1.4, 0.0))]
    assert marks(figures["equivalence"], "o")[0] == pytest.approx((0.6, 1.0))  # 0.3 at a margin of 0.5
    (axes,) = figures["equivalence"].axes
    assert axes.get_xlim()[1] > 1.3


def test_bars_show_the_distance_over_that_of_the_device(figures: dict[str, Figure]) -> None:
    (axes,) = figures["distances"].axes
    widths = [bar.get_width() for bar in axes.patches]  # type: ignore[attr-defined]
    assert widths == pytest.approx([0.4, 2.6, 0.0, 0.4])
    colours = [bar.get_facecolor() for bar in axes.patches]
    assert colours[1] == colours[3] != colours[0] == colours[2]
    assert [text.get_text() for text in axes.texts] == ["0.40", "2.60 differs", "−0.06", "0.40 differs"]
