"""What the charts of a unit draw, read off the figures of a capture with two faults."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from harness.measure.reports import EpisodeMark, UnitReport
from harness.report.kit.style import COLOURS
from harness.report.lab.unit_charts import allan_chart
from harness.report.lab.unit_page import unit_page
from tests.report.drawing import draw_page, drawn_figures, points, texts_apart
from tests.report.reading import emptied


def figures_of(report: UnitReport) -> dict[str, Figure]:
    return drawn_figures(lambda: draw_page(unit_page(report, "")))


@pytest.fixture(scope="module")
def figures(unit_with_faults: UnitReport) -> dict[str, Figure]:
    return figures_of(unit_with_faults)


def test_there_is_a_chart_for_everything_that_was_measured(figures: dict[str, Figure]) -> None:
    assert list(figures) == ["checks", "allan", "spectrum", "episodes", "quality", "pair"]
    for figure in figures.values():
        texts_apart(figure)


def test_without_measurements_nothing_is_drawn(unit_with_faults: UnitReport) -> None:
    measured = ("checks", "allan_position", "allan_orientation", "spectra", "episodes", "quality", "rigid_pairs")
    assert figures_of(replace(unit_with_faults, **emptied(measured))) == {}


def test_departures_are_triangles_right_of_one(figures: dict[str, Figure], unit_with_faults: UnitReport) -> None:
    """A number that departs at every station, together and each, has one row."""
    (axes,) = figures["checks"].axes
    assert axes.get_xscale() == "log"
    marks = [line for line in axes.lines if line.get_marker() in (">", "<", "o")]
    labels = [text.get_text() for text in axes.get_yticklabels()]
    named = {label: mark for label, mark in zip(labels, marks, strict=True) if mark.get_marker() == ">"}
    assert sorted(named) == ["rate of excursions", "white noise of the position"]
    assert sum(check.is_named for check in unit_with_faults.checks) > len(named)
    (white,) = (c for c in unit_with_faults.checks if c.key == "components.white.position_m" and not c.station)
    mark = named["white noise of the position"]
    np.testing.assert_allclose(points(mark)[0], white.measured.value / white.expected.value)
    assert mark.get_color() == COLOURS[0]


def test_a_departure_of_some_stations_has_their_rows(unit_with_faults: UnitReport) -> None:
    """Where a station does not depart, the others stand apart."""
    one = next(check for check in unit_with_faults.checks if check.station == "torso" and check.is_named)
    checks = [replace(check, p_holm=1.0) if check is one else check for check in unit_with_faults.checks]
    (axes,) = figures_of(replace(unit_with_faults, checks=tuple(checks)))["checks"].axes
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert [label for label in labels if label.startswith("white noise of the position")] == [
        "white noise of the position",
        "white noise of the position, head",
        "white noise of the position, left_hand",
    ]


def test_ratios_near_one_have_several_ticks(unit_with_faults: UnitReport) -> None:
    near = tuple(c for c in unit_with_faults.checks if c.key == "components.clock.drift_ppm")
    (axes,) = figures_of(replace(unit_with_faults, checks=near))["checks"].axes
    assert [float(tick) for tick in axes.get_xticks()] == [0.8, 0.9, 1.0, 1.1, 1.2]
    assert axes.get_xlim() == (0.8, 1.25)


def test_allan_deviations_are_in_millimetres_and_degrees(
    figures: dict[str, Figure], unit_with_faults: UnitReport
) -> None:
    position, orientation = figures["allan"].axes
    unit = unit_with_faults
    np.testing.assert_allclose(points(position.lines[0])[1], 1e3 * unit.allan_position[0].deviation)
    np.testing.assert_allclose(points(orientation.lines[0])[1], np.degrees(unit.allan_orientation[0].deviation))
    for axes in (position, orientation):
        assert [line.get_label() for line in axes.lines] == [*unit.capture.stations, "fitted noise"]
        assert len(axes.collections) == len(unit.capture.stations)
    without = replace(unit, allan_position_model=None, allan_orientation_model=None)
    captions = [chart.caption if chart else "" for chart in map(allan_chart, (unit, without))]
    assert ["Dashed" in caption for caption in captions] == [True, False]
    only = figures_of(replace(unit, allan_position=()))["allan"]
    assert [axes.get_ylabel() for axes in only.axes] == ["orientation, one axis [deg]"]


def test_the_spectrum_is_in_square_millimetres(figures: dict[str, Figure], unit_with_faults: UnitReport) -> None:
    (axes,) = figures["spectrum"].axes
    assert [line.get_label() for line in axes.lines] == list(unit_with_faults.capture.stations)
    hz, density = points(axes.lines[-1])
    curve = unit_with_faults.spectra[-1]
    np.testing.assert_allclose(density, 1e6 * curve.density_m2_hz[np.isin(curve.frequency_hz, hz)])


def test_each_episode_is_in_the_row_of_its_station(unit_with_faults: UnitReport) -> None:
    marks = (EpisodeMark("torso", "gap", 120.0, 60.0), EpisodeMark("head", "gap", 0.0, 0.001))
    long = replace(unit_with_faults, episodes=marks, capture=replace(unit_with_faults.capture, duration_s=1200.0))
    (axes,) = figures_of(long)["episodes"].axes
    (lines,) = (each for each in axes.collections if isinstance(each, LineCollection))
    head, torso = (np.asarray(segment) for segment in lines.get_segments())
    np.testing.assert_allclose(torso, [[2.0, 1.0], [3.0, 1.0]])
    np.testing.assert_allclose(head[:, 1], 0.0)
    assert np.ptp(head[:, 0]) > 0.01, "a short episode is wide enough to be seen"
    assert axes.get_xlabel() == "time since the start [min]"
    (axes,) = figures_of(unit_with_faults)["episodes"].axes
    assert axes.get_xlabel() == "time since the start [s]"
    assert len(axes.collections) == 3


def test_quality_has_a_bar_for_each_class_and_errors_for_those_that_are_not_lost(
    figures: dict[str, Figure], unit_with_faults: UnitReport
) -> None:
    shares, errors = figures["quality"].axes
    heights = [bar.get_height() for bar in shares.patches]  # type: ignore[attr-defined]
    np.testing.assert_allclose(heights, [100.0 * one.share for one in unit_with_faults.quality])
    assert sum(heights) == pytest.approx(100.0)
    median, upper = errors.lines
    known = [one for one in unit_with_faults.quality if one.to > 0.0]
    np.testing.assert_allclose(points(median)[0], [0.5 * (one.above + one.to) for one in known])
    np.testing.assert_allclose(points(median)[1], [1e3 * one.median_m for one in known])
    np.testing.assert_allclose(points(upper)[1], [1e3 * one.quantile95_m for one in known])


def test_a_bar_has_its_error_at_the_middle_of_each_class_of_speed(
    figures: dict[str, Figure], unit_with_faults: UnitReport
) -> None:
    (axes,), (pair,) = figures["pair"].axes, unit_with_faults.rigid_pairs
    np.testing.assert_allclose(points(axes.lines[0])[0], [0.5 * (one.from_m_s + one.to_m_s) for one in pair.speeds])
    np.testing.assert_allclose(points(axes.lines[0])[1], [1e3 * one.rms_m.value for one in pair.speeds])
