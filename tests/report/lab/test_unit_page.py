"""The page of a unit: the answer comes first, every section has its numbers, an empty report makes a page too."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput, ShapeError
from harness.report.lab.unit_content import DeviationCurve, EpisodeMark, ParameterRow, StationFigures
from harness.report.lab.unit_page import write_unit_page
from harness.report.lab.unit_text import format_unit
from harness.report.lab.unit_wording import answer
from tests.report.fabricate_lab import TOO_FEW, exact, made_up_unit, number, without_content, without_faults
from tests.report.reading import read, text_of

SECTIONS = (
    *("checks", "parameters", "timing", "stations", "allan", "spectrum"),
    *("episodes", "quality", "bar", "advice", "capture", "command"),
)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_unit_page(tmp_path_factory.mktemp("unit") / "new" / "unit.html", made_up_unit())


def section_ids(page: Path) -> list[str]:
    return [str(attributes["id"]) for name, attributes in read(page).found if name == "section"]


def test_the_answer_is_the_heading_and_the_faults_follow(page: Path) -> None:
    text = text_of(page)
    heading = text.index(answer(made_up_unit()))
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
    assert "white noise of the position 1.500 mm 1.470 to 1.530 48,000 0.75 mm measured" in text
    assert "tilt error before a gap not measured – 0.2498 deg default" in text
    assert f"tilt error before a gap: {TOO_FEW}" in text
    assert "resolution of the stamps 0.061 ms exact – – measured" in text
    assert "excursions [/min] 6.0 4.2 to 7.8 3.00 2.10 to 3.90" in text
    assert "duplicates [%] – 0 exact" in text


def test_numbers_of_the_charts(page: Path) -> None:
    text = text_of(page)
    assert "excursion 360" in text
    assert "gap 24" in text
    assert "coast 0" not in text
    assert "lost (0) 1.00 % – – above 0 to 0.1 1.00 % 11.0 22.0" in text
    assert "error at 1 to 2 m/s (RMS) 4.00 mm 3.60 to 4.40" in text
    assert "There are 360 excursions, 2,010 echoes, 24 gaps." in text
    assert "static 1,200.0 288,000" in text


def test_checks_are_sorted_by_likelihood(page: Path) -> None:
    text = text_of(page)
    table = text[text.index("All 9 checks") :]
    assert table.index("white noise of the position") < table.index("rate of excursions head")
    assert table.index("rate of excursions head") < table.index("smallest excursion")
    assert "white noise of the position all 1.500 mm 1.470 to 1.530 0.75 mm < 0.001 < 0.001" in table


def test_a_report_without_content_makes_a_page(tmp_path: Path) -> None:
    page = write_unit_page(tmp_path / "unit.html", without_content())
    assert section_ids(page) == ["parameters", "command"]
    assert "not held to any expected number" in text_of(page)


def test_the_same_report_gives_the_same_bytes(page: Path, tmp_path: Path) -> None:
    assert write_unit_page(tmp_path / "again.html", made_up_unit()).read_bytes() == page.read_bytes()


def test_the_text_has_the_answer_the_tables_and_fits_a_terminal() -> None:
    lines = format_unit(made_up_unit()).splitlines()
    assert lines[0] == answer(made_up_unit())
    assert lines[1].startswith("- White noise of the position: 1.500 mm (1.470 to 1.530), expected 0.75 mm")
    tables = [line for line in lines if "  " in line]
    assert max(map(len, tables)) <= 118
    joined = "\n".join(lines)
    for part in ("error model", "clock and records", "stations", "episodes", "how long to record"):
        assert f"\n\n{part}\n" in joined
    assert "damage: The last 312 bytes" in joined
    assert f"not measured: tilt error before a gap: {TOO_FEW}" in joined
    assert "checks against the preset default, the least likely of 9 first" in joined
    assert sum(line.startswith(("white noise of the orient", "correlation time")) for line in lines) == 3
    assert "note: Latency cannot be told" in joined


def test_the_text_leaves_out_what_is_not_there() -> None:
    text = format_unit(without_content())
    assert "error model" in text
    assert not any(part in text for part in ("clock and records", "episodes", "checks against", "how long", "bar"))
    assert "- " not in format_unit(without_faults()).splitlines()[1]


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
