"""Charts of a paper: nothing overlaps, nothing is left out, a method keeps its colour."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from harness.core.number_format import Interval
from harness.report.kit.chart import draw_chart, spread_positions
from harness.report.kit.style import COLOURS
from harness.report.paper.charts import figure_charts, figure_table
from harness.report.paper.figures import draw_bars, draw_lines, height_in, is_horizontal
from harness.results.findings import BarChart, LineChart, PaperExperiment
from tests.report.paper.findings import METHODS, curves, liu, sets

EMPTY = PaperExperiment("empty", "", "", ())
PLACES = {name: n for n, name in enumerate(("kernel_cca", "dynamic_map", "local_pca", "ik", "a", "b"))}


def figure_of(shown: BarChart | LineChart, places: Mapping[str, int] = PLACES) -> Figure:
    """The figure after layout."""
    made: list[Figure] = []

    def draw(canvas: Figure) -> None:
        if isinstance(shown, BarChart):
            draw_bars(canvas, shown, places)
        else:
            draw_lines(canvas, shown, places)
        made.append(canvas)

    draw_chart("chart", "", "", "", draw, height_in(shown) if isinstance(shown, BarChart) else 3.4)
    return made[0]


def boxes_of(figure: Figure, texts: Sequence[Any]) -> list[Any]:
    return [text.get_window_extent() for text in texts if text.get_text() and text.get_visible()]


@pytest.mark.parametrize("shown", [sets("walking"), liu().experiments[0].figures[0], liu().experiments[2].figures[0]])
def test_names_and_numbers_do_not_overlap_and_stay_on_the_chart(shown: BarChart) -> None:
    figure = figure_of(shown)
    axes = figure.axes[0]
    names = axes.get_yticklabels() if is_horizontal(shown) else axes.get_xticklabels()
    assert [name.get_text().replace("\n", " ") for name in names] == list(shown.groups)
    boxes = boxes_of(figure, [*names, *axes.texts])
    assert len(boxes) == len(shown.groups) * (1 + len(shown.series))
    for n, box in enumerate(boxes):
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1
        assert not any(box.overlaps(other) for other in boxes[n + 1 :])


def test_bars_are_as_long_as_their_values() -> None:
    shown = sets("walking")
    bars = figure_of(shown).axes[0].patches
    assert [bar.get_width() for bar in bars] == pytest.approx(shown.series["kernel_cca"])  # type: ignore[attr-defined]  # bars are patches to the stubs


@pytest.mark.parametrize(
    ("change", "lying"),
    [
        ({}, False),
        ({"horizontal": True}, True),
        ({"groups": ("a_name_that_is_too_long_to_stand_under_a_bar", "b", "c", "d")}, True),
        ({"groups": ("many words " * 12, "b", "c", "d")}, True),
        ({"groups": tuple(map(str, range(60))), "series": {"a": (1.0,) * 60}}, True),
        ({"groups": (), "series": {}}, False),
    ],
)
def test_bars_lie_where_they_could_not_be_read_standing(change: dict[str, Any], lying: bool) -> None:
    shown = replace(BarChart("", "deg", ("a", "b", "c", "d"), {"a": (1.0, None, -3.0, 4.0)}), **change)
    assert is_horizontal(shown) == lying
    figure_of(shown)


@given(st.lists(st.floats(-2.0, 3.0), max_size=12), st.floats(0.0, 0.2))
def test_names_are_moved_apart_no_further_than_needed(wanted: list[float], gap: float) -> None:
    wanted = sorted(wanted)
    found = spread_positions(wanted, gap)
    assert len(found) == len(wanted)
    assert all(np.diff(found) >= gap - 1e-9)
    assert max(found, default=0.0) <= 1.0 + 1e-9
    if wanted and wanted[-1] <= 1.0 and all(np.diff(wanted) >= gap):
        assert found == pytest.approx(wanted, abs=1e-9)


def test_each_line_has_its_name_at_its_end_in_its_colour() -> None:
    axes = figure_of(curves(400)).axes[0]
    colours = {line.get_label(): line.get_color() for line in axes.lines}
    leaders = {text.get_text(): text.arrow_patch for text in axes.texts if isinstance(text, Annotation)}
    assert {name: to_hex(leader.get_edgecolor()) for name, leader in leaders.items() if leader} == colours
    boxes = boxes_of(axes.get_figure(root=True), axes.texts)  # type: ignore[arg-type]  # no subfigure here
    assert not any(box.overlaps(other) for n, box in enumerate(boxes) for other in boxes[n + 1 :])
    assert min(box.x0 for box in boxes) >= axes.bbox.x1


def test_nothing_is_drawn_across_a_gap() -> None:
    (line,) = (line for line in figure_of(curves(400)).axes[0].lines if line.get_label() == "ik")
    assert np.isnan(np.asarray(line.get_ydata(), dtype=float)[100:130]).all()


def test_a_name_has_one_colour_wherever_it_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the whole page, if several figures have it; and no two names of a figure share one."""
    found: list[tuple[set[str], Mapping[str, int]]] = []

    def note(canvas: Figure, shown: BarChart | LineChart, places: Mapping[str, int]) -> None:
        found.append((set(shown.series), places))

    monkeypatch.setattr("harness.report.paper.charts.draw_bars", note)
    monkeypatch.setattr("harness.report.paper.charts.draw_lines", note)
    several = [
        BarChart("", "", ("a",), dict.fromkeys(names, (1.0,))) for names in (("x", "ik"), ("y", "z"), ("z", "ik"))
    ]
    findings = replace(liu(), experiments=(*liu().experiments, replace(EMPTY, figures=tuple(several))))
    for experiment in findings.experiments:
        for draw_figure in figure_charts(findings, experiment):
            draw_figure()
    assert len(found) == 6
    for names, places in found:
        assert set(places) == names
        assert len(set(places.values())) == len(names)
        assert max(places.values()) < len(COLOURS)
    for name in (*METHODS, "z"):
        assert len({places[name] for names, places in found if name in names}) == 1


def test_the_table_of_a_figure_has_every_number() -> None:
    shown = sets("boxing")
    rows = figure_table(shown).rows
    assert len(rows) == 31
    columns = (shown.groups, shown.series["kernel_cca"], shown.low["kernel_cca"], shown.high["kernel_cca"])
    for row, group, value, low, high in zip(rows, *columns, strict=True):
        assert row == (group, str(Interval.of(value, low, high)))
