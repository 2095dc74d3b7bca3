"""The page of a validated capture: the answer comes first, the registration is shown, each station has its errors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from harness.core.number_format import Interval
from harness.errors import ShapeError
from harness.measure.validation_report import ErrorQuantiles, ResidualSeries, ValidationReport
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import page_text
from harness.report.kit.style import to_svg
from harness.report.lab.validation_page import (
    largest_of_stretches,
    offsets_chart,
    registration_sentences,
    residuals_chart,
    validation_answer,
    validation_page,
)
from tests.report.drawing import texts_apart
from tests.report.fabricate_lab import STATIONS
from tests.report.fabricate_validation import (
    NO_STAMPS,
    SCORES,
    made_up_validation,
    without_exchange,
    without_truth_of_time,
)
from tests.report.reading import read, text_of

ANSWER = (
    "walk.is900rec lies 2.5 to 3.1 mm and 0.46 to 0.57 deg (median of each station) from its reference. It departs "
    "from the preset default in 2 of 3 checks: latency (6.0 times as much), turn of the station against its mount of "
    "head (2.98 deg)."
)


def written(folder: Path, report: ValidationReport) -> Path:
    scores = SCORES if report.accuracy else {}
    return write_page(validation_page(report, scores, "harness validate walk.rec"), folder / "new" / "walk.html")


def printed(report: ValidationReport) -> str:
    return page_text(validation_page(report, SCORES, "harness validate walk.rec"))


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("validation"), made_up_validation())


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    found: dict[str, Figure] = {}

    def keep(figure: Figure, name: str) -> str:
        found[name] = figure
        return to_svg(figure, name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.report.kit.chart.to_svg", keep)
        offsets_chart(made_up_validation())
        residuals_chart(made_up_validation())
    return found


def section_ids(page: Path) -> list[str]:
    return [str(attributes["id"]) for name, attributes in read(page).found if name == "section"]


def test_the_answer_is_the_heading_and_the_faults_follow(page: Path) -> None:
    text = text_of(page)
    heading, exchanged = text.index(ANSWER), text.index("left_foot and right_foot are exchanged.")
    late = text.index("Latency: 24.0 ms (23.6 to 24.4), expected 4 ms, 6.0 times as much.")
    assert heading < exchanged < late < text.index("2,390 of 2,400 frames were matched (99.6 %).")
    assert "Reference clip boxing_p1_01, 60.0 s at 120 Hz" in text


def test_every_section_is_there(page: Path) -> None:
    sections = ["checks", "registration", "poses", "accuracy", "residuals", "scores", "capture", "command"]
    assert section_ids(page) == sections
    pictures = [a for name, a in read(page).found if name in ("img", "svg") and (a.get("alt") or a.get("aria-label"))]
    assert len(pictures) == 2


def test_numbers_have_their_intervals(page: Path) -> None:
    text = text_of(page)
    assert "difference of the two time offsets 2.0 ms 1.4 to 2.6" in text
    assert "heading error 0.06 deg −0.52 to 1.15" in text
    assert "room 0 −1.5 to 1.5 −20.0 −21.5 to −18.5 2,500.0 2,498.5 to 2,501.5 1.0000 0.0000" in text
    assert "head on head_bone 50.0" in text
    assert "0.0000 ± 0.20 deg" in text
    assert "head 2.50 2.38 to 2.62 3.20 3.04 to 3.36 7.10 6.75 to 7.46 0.458 0.435 to 0.481 0.573" in text
    assert "2,390 0.40 %" in text
    assert "local_pca 3.02 not measured" in text


def test_without_departures_all_checks_are_there(tmp_path: Path) -> None:
    text = text_of(written(tmp_path, without_exchange()))
    assert "It shows no departure from the preset default in 3 checks." in text
    assert "scale error all 0.09 % −0.01 to 0.19 0 % 0.078" in text


def test_a_report_without_content_makes_a_page(tmp_path: Path) -> None:
    report = without_truth_of_time()
    page = written(tmp_path, report)
    assert section_ids(page) == ["registration", "command"]
    assert f"time offset by position not measured time offset by position: {NO_STAMPS}" in text_of(page)
    assert validation_answer(report).startswith("No expected number could be compared with walk.is900rec")
    assert registration_sentences(report) == ["2,390 of 2,400 frames were matched (99.6 %)."]


def test_reasons_stand_below_the_accuracy(tmp_path: Path) -> None:
    full = made_up_validation()
    short = Interval.missing("The capture is too short.")
    places = ErrorQuantiles(short, short, short)
    rows = {station: replace(full.accuracy[station], position=places) for station in STATIONS[:2]}
    report = replace(full, accuracy={**full.accuracy, **rows})
    text = f"{STATIONS[0]}, {STATIONS[1]}: The capture is too short."
    assert text in text_of(written(tmp_path, report))
    assert f"not measured: {text}" in printed(report)
    assert "not measured: " not in printed(full)
    assert validation_answer(report).startswith("walk.is900rec lies 2.8 to 3.1 mm")


def test_without_checks_the_answer_has_the_errors_alone() -> None:
    answer = validation_answer(replace(made_up_validation(), checks=()))
    assert answer == ANSWER.partition(" It departs")[0]


def test_the_same_report_gives_the_same_bytes(page: Path, tmp_path: Path) -> None:
    assert written(tmp_path, made_up_validation()).read_bytes() == page.read_bytes()


def test_the_terminal_has_the_answer_first_and_every_number() -> None:
    lines = printed(made_up_validation()).splitlines()
    assert " ".join(lines[:3]) == ANSWER
    assert lines[3] == "- left_foot and right_foot are exchanged."
    assert max(map(len, lines)) <= 118
    text = "\n".join(lines)
    for title in ("checks", "registration", "room and mounts", "accuracy", "reconstruction"):
        assert f"\n\n{title}\n" in text
    assert "head                2.50      3.20       7.10" in text
    assert "not measured: time offset by position: The stream" in printed(without_truth_of_time())
    assert "Latency is known to 0.4 ms" in text


def test_the_two_offsets_have_their_intervals(figures: dict[str, Figure]) -> None:
    (axes,) = figures["offsets"].axes
    values = [np.asarray(line.get_xdata(), dtype=float).tolist() for line in axes.lines]
    assert values == [pytest.approx(each) for each in ([23.6, 24.4], [24.0], [21.5, 22.5], [22.0])]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["by orientation", "by position"]
    texts_apart(figures["offsets"])


def test_each_station_has_its_errors_in_millimetres_and_degrees(figures: dict[str, Figure]) -> None:
    axes = figures["residuals"].axes
    assert len(axes) == 2 * len(STATIONS)
    one = made_up_validation().residuals[0]
    drawn_mm, drawn_deg = (np.asarray(each.lines[0].get_ydata(), dtype=float) for each in axes[:2])
    assert np.nanmax(drawn_mm) == pytest.approx(1e3 * np.nanmax(one.position_m))
    assert np.nanmax(drawn_deg) == pytest.approx(np.degrees(np.nanmax(one.angle_rad)))
    assert [each.get_title(loc="left") for each in axes[:3]] == ["head: position [mm]", "orientation [deg]", "pelvis"]


def test_long_series_keep_their_largest_error_and_their_gaps() -> None:
    time_s = np.arange(5000.0)
    values = np.zeros(5000)
    values[1234] = 9.0
    values[2000:2010] = np.nan
    times, largest = largest_of_stretches(time_s, values)
    assert len(times) == len(largest) == 1000
    assert largest[246] == 9.0
    assert np.isnan(largest[400:402]).all()
    assert not np.isnan(largest[402:]).any()
    short_s, short = largest_of_stretches(time_s[:7], values[:7])
    assert short_s.tolist() == time_s[:7].tolist()
    assert short.tolist() == values[:7].tolist()
    assert [len(each) for each in largest_of_stretches(np.zeros(0), np.zeros(0))] == [0, 0]


def test_series_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ShapeError, match="angle_rad"):
        ResidualSeries("head", np.zeros(3), np.zeros(3), np.zeros(2))
