"""The page of a validated capture: the answer comes first, the registration is shown, each station has its errors."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.number_format import Interval, format_fixed
from harness.errors import ShapeError
from harness.measure.reports import ErrorQuantiles, ResidualSeries, ValidationReport
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.lab.quantities import find_quantity
from harness.report.lab.validation_page import (
    largest_of_stretches,
    validation_answer,
    validation_page,
)
from tests.report.drawing import draw_page, drawn_figures, points, texts_apart
from tests.report.reading import count_pictures, emptied, numbers_in_order, section_ids, text_of

COMMAND = "harness validate walk.rec"
SCORES: dict[str, dict[str, float | None]] = {
    "ik": {"joint_angle_mean_deg": 5.31, "mpjpe_mm": 41.2},
    "local_pca": {"joint_angle_mean_deg": 3.02, "mpjpe_mm": None},
}
pytestmark = pytest.mark.long
SECTIONS = ["checks", "registration", "poses", "accuracy", "residuals", "scores", "capture", "command"]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, late_capture: ValidationReport) -> Path:
    return write_page(
        validation_page(late_capture, SCORES, COMMAND), tmp_path_factory.mktemp("page") / "new" / "a.html"
    )


def printed(report: ValidationReport) -> str:
    return render_text(validation_page(report, SCORES, COMMAND))


def test_the_answer_is_the_heading_and_the_departure_follows(page: Path, late_capture: ValidationReport) -> None:
    text = text_of(page)
    answer = validation_answer(late_capture)
    medians = [1e3 * row.position.median.value for row in late_capture.accuracy.values()]
    assert f"lies {min(medians):.1f} to {max(medians):.1f} mm and " in answer
    assert f"in 1 of {len(late_capture.checks)} checks: latency (" in answer
    late = f"Latency: {find_quantity('latency_s').of(late_capture.numbers['latency_s'])}, expected "
    matched = f"{late_capture.matched_frames:,} of {late_capture.expected_frames:,} frames were matched"
    assert text.index(answer) < text.index(late) < text.index(matched)
    assert f"Reference {late_capture.truth}" in text
    without = validation_answer(replace(late_capture, checks=()))
    assert without == answer.partition(" It departs")[0]


def test_exchanged_stations_are_named_first(exchanged_capture: ValidationReport, tmp_path: Path) -> None:
    text = text_of(write_page(validation_page(exchanged_capture, {}, COMMAND), tmp_path / "a.html"))
    first, second = exchanged_capture.exchanged
    answer = validation_answer(exchanged_capture)
    assert f"It shows no departure from the preset default in {len(exchanged_capture.checks)} checks." in answer
    assert text.index(answer) < text.index(first) < text.index(second) < text.index("frames were matched")
    assert render_text(validation_page(exchanged_capture, {}, COMMAND)).count(f"\n- {first}") == 1


def test_every_section_has_its_numbers_and_their_intervals(page: Path, late_capture: ValidationReport) -> None:
    assert section_ids(page) == SECTIONS
    assert count_pictures(page) == 2
    text = text_of(page)
    for key, number in late_capture.numbers.items():
        assert numbers_in_order(text, find_quantity(key).label, find_quantity(key).of(number)), key
    for pose in late_capture.poses:
        name = f"{pose.name} on {pose.body}" if pose.body else pose.name
        numbers = [
            *(axis.scaled(1e3) for axis in pose.position_m),
            *(format_fixed(float(q), 4) for q in pose.rotation),
        ]
        assert numbers_in_order(text, name, *numbers, f"± {math.degrees(pose.angle_rad):.2f} deg"), name
    for station, row in late_capture.accuracy.items():
        numbers = [q.scaled(1e3) for q in (row.position.median, row.position.rms, row.position.quantile95)]
        numbers += [q.scaled(math.degrees(1.0)) for q in (row.orientation.median, row.orientation.rms)]
        lost = f"{100.0 * row.lost_share:.2f} %"
        assert numbers_in_order(text, f"{station} ", *numbers, f"{row.readings:,}", lost), station
    assert "local_pca 3.02 not measured" in text


def test_a_report_without_content_makes_a_page(tmp_path: Path, late_capture: ValidationReport) -> None:
    """A stream without stamps shows no offset; its reason stands in the place of the number."""
    numbers = {"time_offset_position_s": Interval.missing("The stream has no stamps.")}
    capture = replace(late_capture.capture, stretches=())
    empty = ("poses", "checks", "residuals", "notes")
    report = replace(late_capture, numbers=numbers, accuracy={}, capture=capture, **emptied(empty))
    page = write_page(validation_page(report, {}, COMMAND), tmp_path / "a.html")
    assert section_ids(page) == ["registration", "command"]
    assert "time offset by position not measured time offset by position: The stream has no" in text_of(page)
    assert validation_answer(report).startswith(f"No expected number could be compared with {report.name}")
    assert "Estimated" not in text_of(page)


def test_reasons_stand_below_the_accuracy(late_capture: ValidationReport) -> None:
    """Stations with one reason share its line, and the answer is over the others."""
    short = Interval.missing("The capture is too short.")
    first, second, *others = late_capture.accuracy
    rows = {
        station: replace(late_capture.accuracy[station], position=ErrorQuantiles(short, short, short))
        for station in (first, second)
    }
    report = replace(late_capture, accuracy={**late_capture.accuracy, **rows})
    assert f"not measured: {first}, {second}: {short.reason}" in printed(report)
    assert "not measured: " not in printed(late_capture)
    medians = [1e3 * late_capture.accuracy[station].position.median.value for station in others]
    assert f"lies {min(medians):.1f} to {max(medians):.1f} mm" in validation_answer(report)


def test_the_same_report_gives_the_same_bytes(page: Path, tmp_path: Path, late_capture: ValidationReport) -> None:
    again = write_page(validation_page(late_capture, SCORES, COMMAND), tmp_path / "a.html")
    assert again.read_bytes() == page.read_bytes()


def test_the_terminal_has_the_answer_first_and_every_number(late_capture: ValidationReport) -> None:
    text = printed(late_capture)
    assert " ".join(text.split()).startswith(validation_answer(late_capture))
    assert max(map(len, text.splitlines())) <= 118
    for title in ("checks", "registration", "room and mounts", "accuracy", "reconstruction", "capture"):
        assert f"\n\n{title}\n" in text
    for note in late_capture.notes:
        assert note in " ".join(text.split())
    for station, row in late_capture.accuracy.items():
        assert numbers_in_order(text, f"\n{station} ", row.position.median.scaled(1e3).number, f"{row.readings:,}")


def test_charts_have_both_offsets_and_the_errors_of_each_station(late_capture: ValidationReport) -> None:
    figures = drawn_figures(lambda: draw_page(validation_page(late_capture, {}, "")))
    for figure in figures.values():
        texts_apart(figure)
    (axes,) = figures["offsets"].axes
    offsets = [late_capture.numbers[f"time_offset_{of}_s"] for of in ("orientation", "position")]
    expected = [x for one in offsets for x in ([1e3 * one.low, 1e3 * one.high], [1e3 * one.value])]
    assert [points(line)[0].tolist() for line in axes.lines] == [pytest.approx(each) for each in expected]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["by orientation", "by position"]
    exact = {
        f"time_offset_{of}_s": Interval(-0.3, -0.3 - half_s, -0.3 + half_s)
        for of, half_s in (("orientation", 2e-5), ("position", 4e-6))
    }
    near = replace(late_capture, numbers={**late_capture.numbers, **exact})
    (axes,) = drawn_figures(lambda: draw_page(validation_page(near, {}, "")))["offsets"].axes
    assert "−300.00" in [text.get_text() for text in axes.get_xticklabels()]
    panels, stations = figures["residuals"].axes, list(late_capture.accuracy)
    assert len(panels) == 2 * len(stations)
    for n, one in enumerate(late_capture.residuals):
        drawn_mm, drawn_deg = (points(each.lines[0])[1] for each in panels[2 * n : 2 * n + 2])
        assert np.nanmax(drawn_mm) == pytest.approx(1e3 * np.nanmax(one.position_m))
        assert np.nanmax(drawn_deg) == pytest.approx(np.degrees(np.nanmax(one.angle_rad)))
    titles = [each.get_title(loc="left") for each in panels[:3]]
    assert titles == [f"{stations[0]}: position [mm]", "orientation [deg]", stations[1]]


def test_long_series_keep_their_largest_error_and_their_gaps() -> None:
    time_s, values = np.arange(5000.0), np.zeros(5000)
    values[1234] = 9.0
    values[2000:2010] = np.nan
    times, largest = largest_of_stretches(time_s, values)
    assert len(times) == len(largest) == 1000
    assert largest[246] == 9.0
    assert np.isnan(largest[400:402]).all()
    assert not np.isnan(largest[402:]).any()
    for length in (7, 0):
        short_s, short = largest_of_stretches(time_s[:length], values[:length])
        assert (short_s.tolist(), short.tolist()) == (time_s[:length].tolist(), values[:length].tolist())


def test_series_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ShapeError, match="angle_rad"):
        ResidualSeries("head", np.zeros(3), np.zeros(3), np.zeros(2))
