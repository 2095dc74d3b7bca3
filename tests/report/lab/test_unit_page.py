"""The page of a unit: the answer comes first, every section has its numbers, an empty report makes a page too."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput, ShapeError
from harness.measure.unit_report import DeviationCurve, EpisodeMark, ParameterRow, StationFigures, UnitReport
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import page_text
from harness.report.lab.unit_page import unit_page
from tests.report.fabricate_lab import TOO_FEW, exact, made_up_unit, number, without_content, without_faults
from tests.report.reading import read, text_of

COMMAND = "harness characterize lab.is900rec"
SECTIONS = (
    *("checks", "parameters", "timing", "stations", "allan", "spectrum"),
    *("episodes", "quality", "bar", "advice", "capture", "command"),
)


def written(folder: Path, report: UnitReport) -> Path:
    return write_page(unit_page(report, COMMAND, "unit.toml"), folder / "new" / "unit.html")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("unit"), made_up_unit())


def section_ids(page: Path) -> list[str]:
    return [str(attributes["id"]) for name, attributes in read(page).found if name == "section"]


def test_the_answer_is_the_heading_and_the_faults_follow(page: Path) -> None:
    text = text_of(page)
    heading = text.index("lab departs from the preset default in 3 of 9 checks")
    fault = text.index("Rate of excursions of head: 6.0 /min (4.8 to 7.2), expected 1 /min, 6.0 times as much.")
    like = text.index("At rest, a position scatters by 2.90 to 3.40 mm")
    assert heading < fault < like < text.index("Damage")
    assert "The last 312 bytes are not a whole block" in text


def test_every_section_is_there_with_its_charts_and_numbers(page: Path) -> None:
    assert section_ids(page) == list(SECTIONS)
    pictures = [a for name, a in read(page).found if name in ("img", "svg") and (a.get("alt") or a.get("aria-label"))]
    assert len(pictures) == 6
    text = text_of(page)
    assert text.count("Numbers of this chart") == 5
    assert "All 9 checks" in text


def test_intervals_stand_below_their_numbers(page: Path) -> None:
    text = text_of(page)
    assert "white noise of the position 1.50 mm 1.47 to 1.53 48,000 0.75 mm measured" in text
    assert "tilt error before a gap not measured – 0.2498 deg default" in text
    assert f"tilt error before a gap: {TOO_FEW}" in text
    assert "resolution of the stamps 0.061 ms exact – – measured" in text
    assert "excursions [/min] 6.0 4.2 to 7.8 3.0 2.1 to 3.9" in text
    assert "duplicates [%] – 0 exact" in text


def test_numbers_of_the_charts(page: Path) -> None:
    text = text_of(page)
    assert "excursion 360" in text
    assert "gap 24" in text
    assert "lost (0) 1.00 % – – above 0 to 0.1 1.00 % 11.0 22.0" in text
    assert "error at 1 to 2 m/s (RMS) 4.0 mm 3.6 to 4.4" in text
    assert "There are 360 excursions, 2,010 echoes, 24 gaps." in text
    assert "static 1,200.0 288,000" in text


def test_checks_are_sorted_by_likelihood(page: Path) -> None:
    text = text_of(page)
    table = text[text.index("All 9 checks") :]
    assert table.index("white noise of the position") < table.index("rate of excursions head")
    assert table.index("rate of excursions head") < table.index("smallest excursion")
    assert "white noise of the position all 1.50 mm 1.47 to 1.53 0.75 mm < 0.001 < 0.001" in table


def test_a_report_without_content_makes_a_page(tmp_path: Path) -> None:
    page = written(tmp_path, without_content())
    assert section_ids(page) == ["parameters", "command"]
    assert "No expected number could be compared with lab." in text_of(page)


def test_the_same_report_gives_the_same_bytes(page: Path, tmp_path: Path) -> None:
    assert written(tmp_path, made_up_unit()).read_bytes() == page.read_bytes()


def test_the_terminal_has_the_answer_first_and_every_number() -> None:
    lines = page_text(unit_page(made_up_unit(), COMMAND)).splitlines()
    assert lines[0].startswith("lab departs from the preset default in 3 of 9 checks")
    assert lines[2].startswith("- White noise of the position: 1.50 mm (1.47 to 1.53), expected 0.75 mm")
    assert max(map(len, lines)) <= 118
    parts = [line for before, line in pairwise(lines) if not before]
    assert parts[1:] == ["checks", "error model", "clock and records", "stations", "episodes", "stations on a bar",
                         "how long to record", "capture"]  # fmt: skip
    text = "\n".join(lines)
    assert f"not measured: tilt error before a gap: {TOO_FEW}" in text
    assert "and 1 more" in lines
    assert "Latency cannot be told" in text


def test_the_terminal_leaves_out_what_is_not_there() -> None:
    text = page_text(unit_page(without_content(), COMMAND))
    assert "error model" in text
    assert not any(part in text for part in ("clock and records", "episodes", "how long", "bar", "unit file"))
    assert "- " not in page_text(unit_page(without_faults(), COMMAND)).splitlines()[1]


def test_a_row_says_whether_the_unit_file_has_it_measured() -> None:
    assert ParameterRow("a.b_m", exact(1.0), 2.0).status == "measured"
    missing = made_up_unit().parameters[-1]
    assert missing.status == "default"
    assert replace(missing, default=None).status == "not measured"


def test_contents_that_do_not_fit_are_refused() -> None:
    with pytest.raises(BadInput, match="kind 'jump'"):
        EpisodeMark("head", "jump", 0.0, 1.0)
    with pytest.raises(BadInput, match="called 'height_m'"):
        StationFigures("head", {"height_m": number(1.0, 0.1)})
    with pytest.raises(ShapeError, match="low"):
        DeviationCurve("head", np.ones(3), np.ones(3), np.ones(2), np.ones(3))
