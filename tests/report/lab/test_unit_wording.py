"""A unit in words: the answer names each fault, and what was not measured is not described."""

from dataclasses import replace

import numpy as np

from harness.core.number_format import Interval
from harness.measure.departures import Departure, compare_with_expected
from harness.measure.unit_report import ParameterRow, RecordingAdvice, UnitReport
from harness.report.lab.departures import condense_departures, departure_texts, departures_sentence
from harness.report.lab.unit_page import advice_text, description
from tests.report.fabricate_lab import exact, made_up_unit, number, without_content, without_faults


def check(key: str, measured: Interval, expected: float, station: str = "") -> Departure:
    return replace(compare_with_expected(key, station, measured, exact(expected)), p_holm=0.001)


def answer(report: UnitReport) -> str:
    return departures_sentence(report.name, report.checks, report.expected_from)


def departure_text(one: Departure) -> str:
    (text,) = departure_texts([one])
    return text


def test_the_answer_names_the_faults_and_their_sizes() -> None:
    assert answer(made_up_unit()) == (
        "lab departs from the preset default in 3 of 9 checks: white noise of the position (2.0 times as much), rate "
        "of excursions (3.1 times as much), rate of excursions of head (6.0 times as much)."
    )
    assert answer(without_faults()) == "lab shows no departure from the preset default in 9 checks."
    assert answer(without_content()) == "No expected number could be compared with lab."
    clock = replace(made_up_unit(), checks=(check("components.clock.drift_ppm", number(80.0, 0.1), 20.0),))
    assert answer(clock).endswith("in 1 of 1 check: error of the clock's rate (4.0 times as much).")


def test_a_departure_of_all_stations_is_told_once() -> None:
    key = "components.echo.share"
    together, head = check(key, number(0.09, 0.1), 0.03), check(key, number(0.09, 0.1), 0.03, "head")
    other = check(key, number(0.09, 0.1), 0.03, "torso")
    sound = replace(other, p_holm=1.0)
    assert condense_departures([together, head, other]) == [together]
    assert condense_departures([together, head, sound]) == [together, head]
    assert condense_departures([replace(together, p_holm=1.0), head, other]) == [head, other]
    unit = replace(made_up_unit(), checks=(together, head, other))
    assert answer(unit).endswith("in 3 of 3 checks: share of echoes (3.0 times as much).")


def test_many_faults_are_counted() -> None:
    one = check("components.echo.share", number(0.09, 0.1), 0.03, "head")
    assert answer(replace(made_up_unit(), checks=(one,) * 6)).endswith("(3.0 times as much) and 2 more.")


def test_a_departure_has_its_interval_and_what_was_expected() -> None:
    text = departure_text(check("components.echo.share", number(0.09, 0.1), 0.03, "head"))
    assert text == "Share of echoes of head: 9.0 % (8.1 to 9.9), expected 3 %, 3.0 times as much."
    less = departure_text(check("components.echo.share", number(0.015, 0.1), 0.03))
    assert less == "Share of echoes: 1.50 % (1.35 to 1.65), expected 3 %, 50 % of it."


def test_ratios_are_left_out_where_they_say_nothing() -> None:
    duplicates = check("timing.duplicate_share", number(0.01, 0.1), 0.0)
    assert departure_text(duplicates) == "Share of duplicate records: 1.0 % (0.9 to 1.1), expected 0 %."
    assert departure_text(check("timing.rate_hz", number(40.5, 0.001), 40.0)).endswith("expected 40 Hz.")
    assert departure_text(check("components.clock.drift_ppm", Interval(-30.0, -31.0, -29.0), 20.0)).endswith("20 ppm.")
    assert departure_text(check("timing.jitter_s", number(0.02, 0.1), 0.001)).endswith("20 times as much.")


def test_the_description_has_numbers_that_were_measured_only() -> None:
    assert description(made_up_unit()) == [
        "At rest, a position scatters by 2.90 to 3.40 mm and an orientation scatters by 0.58 deg (RMS, everything "
        "included).",
        "On each axis a position has 1.50 mm of white noise and 1.520 mm of drift, which lasts 0.980 s.",
        "A station has 3.10 excursions a minute of 5.20 to 29.8 mm.",
        "Of the readings 3.04 % are echoes and 0 % are sent twice.",
        "Records of a station come at 40.000 Hz and the clock runs 21.0 ppm slow.",
    ]
    assert description(without_content()) == []


def test_means_stand_in_for_ends_and_a_fast_clock_is_fast() -> None:
    rows = (
        ParameterRow("components.excursion.onsets_per_min", number(1.0, 0.2), 1.0),
        ParameterRow("components.excursion.stay_s", number(3.0, 0.1), 3.0),
        ParameterRow("components.clock.drift_ppm", number(20.0, 0.1), 20.0),
    )
    unit = replace(without_content(), parameters=rows)
    assert description(unit) == ["A station has 1.0 excursions a minute for 3.0 s.", "The clock runs 20 ppm fast."]


def test_the_advice_says_how_long_to_record() -> None:
    key = "components.excursion.onsets_per_min"
    assert advice_text(RecordingAdvice(key, 0.2, 120, 97, 20.0, 16.2)) == (
        "To know the rate of excursions to 20 %: this capture has 120 events in 20 min, which is enough (97 are "
        "needed)."
    )
    assert advice_text(RecordingAdvice(key, 0.2, 1, 97, 2.0, 194.0)) == (
        "To know the rate of excursions to 20 %: record 194 min at this rate (97 events). This capture has 1 event in "
        "2.0 min."
    )
    assert advice_text(RecordingAdvice(key, 0.1, 0, 385, 2.0, np.nan)) == (
        "To know the rate of excursions to 10 %: 385 events are needed. This capture has 0 events in 2.0 min: no rate "
        "to go by."
    )
