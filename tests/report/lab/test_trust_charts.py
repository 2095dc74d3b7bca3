"""What the charts of a trust study draw, read off the figures."""

from dataclasses import replace

import pytest
from matplotlib.figure import Figure

from harness.report.lab.trust_page import trust_page
from harness.results.findings import TrustFindings
from tests.report.drawing import draw_page, drawn_figures, points, texts_apart

pytestmark = pytest.mark.long


def figures_of(findings: TrustFindings) -> dict[str, Figure]:
    return drawn_figures(lambda: draw_page(trust_page(findings, "")))


@pytest.fixture(scope="module")
def figures(trust_findings: TrustFindings) -> dict[str, Figure]:
    return figures_of(trust_findings)


def marks(figure: Figure, marker: str) -> list[tuple[float, float]]:
    """Places of the marks of this kind."""
    (axes,) = figure.axes
    lines = [points(line) for line in axes.lines if line.get_marker() == marker]
    return [(float(x.item()), float(y.item())) for x, y in lines]


def test_there_is_a_chart_for_everything_that_was_measured(
    figures: dict[str, Figure], trust_findings: TrustFindings
) -> None:
    assert list(figures) == ["pairs", "ranks", "equivalence", "distances"]
    for figure in figures.values():
        texts_apart(figure)
    nothing = replace(trust_findings, pairs=(), equivalences=(), distances=())
    assert figures_of(nothing) == {}
    one = replace(trust_findings, pairs=(), equivalences=trust_findings.equivalences[:1])
    assert list(figures_of(one)) == ["equivalence", "distances"]


def test_a_pair_has_both_sides_in_its_row(figures: dict[str, Figure], trust_findings: TrustFindings) -> None:
    order = ("contradict", "cannot tell", "agree")
    pairs = sorted(trust_findings.pairs, key=lambda pair: order.index(pair.verdict))
    for marker, side, shift in (("o", "device", -0.14), ("s", "simulated", 0.14)):
        expected = [(getattr(pair, side).mean, row + shift) for row, pair in enumerate(pairs)]
        assert marks(figures["pairs"], marker) == [pytest.approx(each) for each in expected]
    (axes,) = figures["pairs"].axes
    assert [text.get_text() for text in axes.texts] == ["cannot tell", "cannot tell", "agree"]
    assert axes.get_xlabel() == "difference in joint angle error [deg]"


def test_methods_stand_at_their_errors_on_both_sides(figures: dict[str, Figure], trust_findings: TrustFindings) -> None:
    ranked = [row for row in trust_findings.equivalences if row.metric == "joint_angle_mean_deg"]
    expected = sorted((float(row.device or 0.0), float(row.simulated or 0.0)) for row in ranked)
    assert marks(figures["ranks"], "o") == [pytest.approx(each) for each in expected]
    (axes,) = figures["ranks"].axes
    assert axes.get_xlim() == axes.get_ylim()
    assert sorted(text.get_text() for text in figures["ranks"].legends[0].get_texts()) == sorted(trust_findings.arms)


def test_differences_are_drawn_in_margins(figures: dict[str, Figure], trust_findings: TrustFindings) -> None:
    beyond = [row for row in trust_findings.equivalences if row.verdict == "beyond the margin"]
    assert beyond
    drawn = sorted(x for name in ("D", "o") for x, _ in marks(figures["equivalence"], name))
    in_margins = [float(row.difference or 0.0) / row.margin for row in trust_findings.equivalences]
    assert drawn == pytest.approx(sorted(max(value, -6.0) for value in in_margins))  # 6 margins are the edge
    assert len(marks(figures["equivalence"], "D")) == len(beyond)
    (axes,) = figures["equivalence"].axes
    assert axes.get_xlim()[1] >= 1.3


def test_bars_show_the_distance_over_that_of_the_device(
    figures: dict[str, Figure], trust_findings: TrustFindings
) -> None:
    (axes,) = figures["distances"].axes
    rows = trust_findings.distances
    ratios = [float(row.distance or 0.0) / float(row.split_half or 1.0) for row in rows]
    widths = [bar.get_width() for bar in axes.patches]  # type: ignore[attr-defined]
    assert widths == pytest.approx([max(ratio, 0.0) for ratio in ratios])
    differ = [row.p_holm is not None and row.p_holm <= 0.05 for row in rows]
    assert 0 < sum(differ) < len(rows)
    colours = {differs: bar.get_facecolor() for bar, differs in zip(axes.patches, differ, strict=True)}
    assert colours[True] != colours[False]
    assert len({bar.get_facecolor() for bar in axes.patches}) == 2
    texts = [f"{ratio:.2f}{' differs' * differs}" for ratio, differs in zip(ratios, differ, strict=True)]
    assert [text.get_text().replace("−", "-") for text in axes.texts] == texts
