"""What the charts of a unit draw, read off the figures."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from harness.core.arrays import Floats
from harness.measure.unit_report import EpisodeMark, UnitReport
from harness.report.kit.page import Drawing
from harness.report.kit.style import COLOURS, Chart, to_svg
from harness.report.lab.unit_charts import allan_chart
from harness.report.lab.unit_page import unit_page
from tests.report.drawing import texts_apart
from tests.report.fabricate_lab import STATIONS, made_up_unit, without_content


def figures_of(report: UnitReport) -> dict[str, Figure]:
    """Name of the chart -> its figure."""
    figures: dict[str, Figure] = {}

    def keep(figure: Figure, name: str) -> str:
        figures[name] = figure
        return to_svg(figure, name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.report.kit.chart.to_svg", keep)
        charts(report)
    return figures


def charts(report: UnitReport) -> dict[str, Chart]:
    """Name of the chart -> the chart, of all that the page draws."""
    blocks = [block for section in unit_page(report, "").sections for block in section.blocks]
    drawn = [block.chart() for block in blocks if isinstance(block, Drawing) and callable(block.chart)]
    return {chart.name: chart for chart in drawn if chart}


def points(line: Line2D) -> tuple[Floats, Floats]:
    """The coordinates of a line."""
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    return figures_of(made_up_unit())


def test_there_is_a_chart_for_everything_that_was_measured(figures: dict[str, Figure]) -> None:
    assert list(figures) == ["checks", "allan", "spectrum", "episodes", "quality", "pair"]
    assert charts(without_content()) == {}


def test_names_and_numbers_do_not_overlap(figures: dict[str, Figure]) -> None:
    for figure in figures.values():
        texts_apart(figure)


def test_departures_are_triangles_right_of_one(figures: dict[str, Figure]) -> None:
    (axes,) = figures["checks"].axes
    assert axes.get_xscale() == "log"
    marks = [line for line in axes.lines if line.get_marker() in (">", "<", "o")]
    assert [line.get_marker() for line in marks] == [">", "o", "o", "o", ">", "o", "o", "o", ">"]
    np.testing.assert_allclose(points(marks[0])[0][0], 2.0)
    assert marks[0].get_color() == COLOURS[0]
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert labels[0] == "white noise of the position"
    assert labels[-1] == "rate of excursions, head"


def test_stations_that_all_depart_have_no_rows_of_their_own() -> None:
    unit = made_up_unit()
    head = unit.checks[-1]
    torso = replace(head, station="pelvis")
    axes = figures_of(replace(unit, checks=(*unit.checks, torso)))["checks"].axes[0]
    assert len(axes.get_yticklabels()) == 8


def test_ratios_near_one_have_several_ticks() -> None:
    unit = made_up_unit()
    near = figures_of(replace(unit, checks=unit.checks[1:4]))["checks"].axes[0]
    ticks = [float(tick) for tick in near.get_xticks()]
    assert ticks == [0.8, 0.9, 1.0, 1.1, 1.2]
    assert near.get_xlim() == (0.8, 1.25)


def test_allan_deviations_are_in_millimetres_and_degrees(figures: dict[str, Figure]) -> None:
    position, orientation = figures["allan"].axes
    unit = made_up_unit()
    np.testing.assert_allclose(points(position.lines[0])[1], 1e3 * unit.allan_position[0].deviation)
    np.testing.assert_allclose(points(orientation.lines[0])[1], np.degrees(unit.allan_orientation[0].deviation))
    assert [line.get_label() for line in position.lines] == [*STATIONS, "fitted model"]
    assert len(position.collections) == len(STATIONS)
    with_model, without = (allan_chart(each) for each in (unit, replace(unit, allan_position_model=None)))
    captions = [chart.caption if chart else "" for chart in (with_model, without)]
    assert ["Dashed" in caption for caption in captions] == [True, False]
    only = figures_of(replace(unit, allan_position=()))["allan"]
    assert [axes.get_ylabel() for axes in only.axes] == ["orientation, one axis [deg]"]


def test_the_spectrum_is_in_square_millimetres(figures: dict[str, Figure]) -> None:
    (axes,) = figures["spectrum"].axes
    np.testing.assert_allclose(points(axes.lines[-1])[1], 1e6 * made_up_unit().spectra[-1].density_m2_hz)


def test_each_episode_is_in_the_row_of_its_station(figures: dict[str, Figure]) -> None:
    marks = (EpisodeMark("pelvis", "gap", 120.0, 60.0), EpisodeMark("head", "gap", 0.0, 0.001))
    (axes,) = figures_of(replace(made_up_unit(), episodes=marks))["episodes"].axes
    (lines,) = (each for each in axes.collections if isinstance(each, LineCollection))
    head, pelvis = lines.get_segments()
    np.testing.assert_allclose(np.asarray(pelvis)[:, 0], [2.0, 3.0])
    np.testing.assert_allclose(np.asarray(pelvis)[:, 1], 1.0)
    np.testing.assert_allclose(np.asarray(head)[:, 1], 0.0)
    assert np.ptp(np.asarray(head)[:, 0]) > 0.01, "a short episode is wide enough to be seen"
    assert axes.get_xlabel() == "time since the start [min]"
    short = replace(made_up_unit(), episodes=marks, capture=replace(made_up_unit().capture, duration_s=300.0))
    assert figures_of(short)["episodes"].axes[0].get_xlabel() == "time since the start [s]"


def test_quality_has_a_bar_for_each_class_and_errors_for_those_that_are_not_lost(figures: dict[str, Figure]) -> None:
    shares, errors = figures["quality"].axes
    heights = [bar.get_height() for bar in shares.patches]  # type: ignore[attr-defined]
    np.testing.assert_allclose(heights, [1.0] * 10 + [90.0])
    median, upper = errors.lines
    np.testing.assert_allclose(points(median)[0], np.arange(0.05, 1.0, 0.1))
    assert np.all(points(upper)[1] > points(median)[1])


def test_a_bar_has_its_error_at_the_middle_of_each_class_of_speed(figures: dict[str, Figure]) -> None:
    (axes,) = figures["pair"].axes
    np.testing.assert_allclose(points(axes.lines[0])[0], [0.025, 0.15, 0.375, 0.75, 1.5])
    np.testing.assert_allclose(points(axes.lines[0])[1], [2.0, 2.1, 2.5, 3.0, 4.0])
