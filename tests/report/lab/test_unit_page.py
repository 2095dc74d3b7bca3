"""The page of a unit: the answer comes first, every section has its numbers, hardly any content makes a page too."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from harness.core.number_format import Interval
from harness.errors import BadInput, ShapeError
from harness.measure.reports import (
    DeviationCurve,
    EpisodeMark,
    ParameterRow,
    RecordingAdvice,
    StationFigures,
    UnitReport,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.lab.quantities import find_quantity
from harness.report.lab.unit_page import advice_text, description, unit_page
from tests.report.reading import count_pictures, numbers_in_order, section_ids, text_of

COMMAND = "harness characterize rig.rec"
SECTIONS = [
    *("checks", "parameters", "timing", "stations", "allan", "spectrum"),
    *("episodes", "quality", "bar", "advice", "capture", "command"),
]
WHITE, RATE = "components.white.position_m", "components.excursion.onsets_per_min"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, unit_with_faults: UnitReport) -> Path:
    return write_page(unit_page(unit_with_faults, COMMAND, "unit.toml"), tmp_path_factory.mktemp("unit") / "a" / "u")


@pytest.fixture(scope="module")
def bare(unit_with_faults: UnitReport) -> UnitReport:
    """A unit of which nothing was measured."""
    rows = tuple(replace(row, measured=Interval.missing("too few")) for row in unit_with_faults.parameters)
    capture = replace(unit_with_faults.capture, stretches=(), damage=())
    return UnitReport("rig", capture, unit_with_faults.expected_from, rows, (), (), ())


def test_the_answer_is_the_heading_and_each_departure_follows_with_its_size(
    page: Path, unit_with_faults: UnitReport
) -> None:
    text = text_of(page)
    named = {(check.key, check.station): check for check in unit_with_faults.checks if check.is_named}
    assert f"rig departs from the preset default in {len(named)} of {len(unit_with_faults.checks)} checks" in text
    places = [text.index(f"{find_quantity(key).of(named[key, ''].measured)}, expected ") for key in (WHITE, RATE)]
    assert places == sorted(places)
    (damage,) = unit_with_faults.capture.damage
    assert text.count(damage) == 2
    assert places[-1] < text.index("At rest, ") < text.index(damage)


def test_every_section_is_there_with_its_charts_and_numbers(page: Path, unit_with_faults: UnitReport) -> None:
    assert section_ids(page) == SECTIONS
    assert count_pictures(page) == 6
    text = text_of(page)
    assert text.count("Numbers of this chart") == 5
    assert f"All {len(unit_with_faults.checks)} checks" in text
    assert all(
        f"{part.name} {part.duration_s:.1f} {part.records:,}" in text for part in unit_with_faults.capture.stretches
    )


def test_each_number_has_its_interval_its_default_and_its_origin(page: Path, unit_with_faults: UnitReport) -> None:
    text = text_of(page)
    rows = (*unit_with_faults.parameters, *unit_with_faults.timing)
    assert {row.status for row in rows} == {"measured", "default"}
    for row in rows:
        shown = find_quantity(row.key)
        default = "–" if row.default is None else shown.exact(row.default)
        count = f"{row.measured.count:,}" if row.measured.count else "–"
        assert numbers_in_order(text, shown.label, shown.of(row.measured), count, default, row.status), row.key
        assert row.measured.reason.partition("`")[0] in text
    for station in unit_with_faults.stations:
        for name, number in station.figures.items():
            assert not number.is_measured or find_quantity(f"station.{name}").bare(number).number in text


def test_numbers_of_the_charts(page: Path, unit_with_faults: UnitReport) -> None:
    text = text_of(page)
    for kind in ("excursion", "echo", "gap"):
        assert f"{kind} {sum(mark.kind == kind for mark in unit_with_faults.episodes)} " in text
    (pair,) = unit_with_faults.rigid_pairs
    for one in pair.speeds:
        assert numbers_in_order(
            text, f"error at {one.from_m_s:g} to {one.to_m_s:g} m/s", find_quantity("rms_m").of(one.rms_m)
        )
    lost, *_, best = unit_with_faults.quality
    assert f"lost (0) {100.0 * lost.share:.2f} %" in text
    assert f"{100.0 * best.share:.2f} % {1e3 * best.median_m:.1f} {1e3 * best.quantile95_m:.1f}" in text


def test_checks_are_sorted_by_likelihood(page: Path, unit_with_faults: UnitReport) -> None:
    text = text_of(page)
    table = text[text.index("All ") :]
    ordered = sorted(unit_with_faults.checks, key=lambda check: (check.p_holm, check.p))
    assert numbers_in_order(table, *(f"{find_quantity(one.key).label} {one.station or 'all'} " for one in ordered))


def test_a_report_without_content_makes_a_page(tmp_path: Path, bare: UnitReport) -> None:
    page = write_page(unit_page(bare, COMMAND), tmp_path / "unit.html")
    assert section_ids(page) == ["parameters", "command"]
    assert "No expected number could be compared with rig." in text_of(page)
    text = render_text(unit_page(bare, COMMAND))
    assert not any(part in text for part in ("clock and records", "episodes", "how long", "bar", "unit file", "\n- "))


def test_the_same_report_gives_the_same_bytes(page: Path, tmp_path: Path, unit_with_faults: UnitReport) -> None:
    again = write_page(unit_page(unit_with_faults, COMMAND, "unit.toml"), tmp_path / "u")
    assert again.read_bytes() == page.read_bytes()


def test_the_terminal_has_the_answer_first_and_every_number(unit_with_faults: UnitReport) -> None:
    lines = render_text(unit_page(unit_with_faults, COMMAND)).splitlines()
    assert lines[0].startswith("rig departs from the preset default in ")
    assert max(map(len, lines)) <= 118
    parts = [line for before, line in pairwise(lines) if not before]
    assert parts[1:] == ["checks", "error model", "clock and records", "stations", "episodes", "stations on a bar",
                         "how long to record", "capture"]  # fmt: skip
    text = "\n".join(lines)
    for row in unit_with_faults.parameters:
        assert f"{find_quantity(row.key).of(row.measured)}" in text
    printed = max(8, sum(check.is_named for check in unit_with_faults.checks))
    assert f"and {len(unit_with_faults.checks) - printed} more" in lines


def test_a_row_says_whether_the_unit_file_has_it_measured() -> None:
    measured = ParameterRow("a.b_m", Interval(1.0, 1.0, 1.0), 2.0)
    missing = replace(measured, measured=Interval.missing("too few"))
    assert [row.status for row in (measured, missing, replace(missing, default=None))] == [
        "measured", "default", "not measured",
    ]  # fmt: skip


def test_contents_that_do_not_fit_are_refused() -> None:
    with pytest.raises(BadInput, match="kind 'jump'"):
        EpisodeMark("head", "jump", 0.0, 1.0)
    with pytest.raises(BadInput, match="called 'height_m'"):
        StationFigures("head", {"height_m": Interval(1.0, 1.0, 1.0)})
    with pytest.raises(ShapeError, match="low"):
        DeviationCurve("head", np.ones(3), np.ones(3), np.ones(2), np.ones(3))


def test_the_description_has_numbers_that_were_measured_only(unit_with_faults: UnitReport, bare: UnitReport) -> None:
    spread, noise, excursions, shares, timing = description(unit_with_faults)
    values = {row.key: find_quantity(row.key).of(row.measured).number for row in unit_with_faults.parameters}
    for name, words in (("half_within_m", "positions lie within"), ("most_within_m", "95 % in")):
        figures = [row.figures[name].value for row in unit_with_faults.stations]
        assert f"{words} {1e3 * min(figures):.2f} to {1e3 * max(figures):.2f} mm" in spread
    drift = "components.drift"
    assert numbers_in_order(noise, *(values[key] for key in (WHITE, f"{drift}.position_m", f"{drift}.correlation_s")))
    assert "which lasts" in noise
    rows = [
        replace(row, measured=Interval(0.0, 0.0, 1e-5)) if row.key == f"{drift}.position_m" else row
        for row in unit_with_faults.parameters
    ]
    assert "which lasts" not in description(replace(unit_with_faults, parameters=tuple(rows)))[1]
    assert excursions == f"A station has {values[RATE].removesuffix(' /min')} excursions a minute."
    assert numbers_in_order(shares, *(values[f"components.{name}.share"] for name in ("echo", "dropout")), "0 %", "0 %")
    assert timing.endswith(f"{values['components.clock.drift_ppm']} fast.")
    assert description(bare) == []


def test_ends_of_an_excursion_come_before_its_mean_and_a_slow_clock_is_slow(unit_with_faults: UnitReport) -> None:
    size, stay, clock = ("components.excursion.size_m", "components.excursion.stay_s", "components.clock.drift_ppm")
    values = {RATE: 1.0, f"{size}.0": 0.005, f"{size}.1": 0.03, size: 0.02, stay: 3.0, clock: -20.0}
    rows = tuple(ParameterRow(key, Interval(v, v - 0.1 * abs(v), v + 0.1 * abs(v)), v) for key, v in values.items())
    unit = replace(unit_with_faults, parameters=rows, timing=(), stations=())
    assert description(unit) == [
        "A station has 1.0 excursions a minute of 5.0 to 30 mm for 3.0 s.", "The clock runs 20 ppm slow.",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("events", "minutes", "needed_minutes", "said"),
    [
        (120, 20.0, 16.2, "this capture has 120 events in 20 min, which is enough (97 are needed)"),
        (1, 2.0, 194.0, "record 194 min at this rate (97 events). This capture has 1 event in 2.0 min"),
        (0, 2.0, np.nan, "97 events are needed. This capture has 0 events in 2.0 min: no rate to go by"),
    ],
)
def test_the_advice_says_how_long_to_record(events: int, minutes: float, needed_minutes: float, said: str) -> None:
    text = advice_text(RecordingAdvice(RATE, 0.2, events, 97, minutes, needed_minutes))
    assert text == f"To know the rate of excursions to 20 %: {said}."
