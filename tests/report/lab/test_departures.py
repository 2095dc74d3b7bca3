"""Departures in words: each fault with its size, and one that all stations share is told once."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from harness.core.number_format import Interval
from harness.measure.reports import Departure, compare_with_expected
from harness.report.lab.departures import condense_departures, departure_texts, departures_sentence

ECHOES = "components.echo.share"


def check(key: str, measured: float, expected: float, station: str = "", share: float = 0.1) -> Departure:
    """A departure whose interval reaches a share of the number to both sides."""
    number = Interval(measured, measured - share * abs(measured), measured + share * abs(measured), 100)
    return replace(compare_with_expected(key, station, number, Interval(expected, expected, expected)), p_holm=0.001)


def answer(checks: Sequence[Departure]) -> str:
    return departures_sentence("lab", checks, "the preset")


def test_the_answer_names_the_faults_and_their_sizes() -> None:
    clock, head = check("components.clock.drift_ppm", 80.0, 20.0), check(ECHOES, 0.09, 0.03, "head")
    sound = replace(clock, p_holm=0.06)
    assert answer([clock, head, sound]) == (
        "lab departs from the preset in 2 of 3 checks: error of the clock's rate (4.0 times as much), share of echoes "
        "of head (3.0 times as much)."
    )
    assert answer([sound]) == "lab shows no departure from the preset in 1 check."
    assert answer([]) == "No expected number could be compared with lab."
    assert answer([check("mount_turn_rad", 0.052, 0.0)]).endswith("turn of the station against its mount (2.98 deg).")
    assert answer([head] * 6).endswith("(3.0 times as much) and 2 more.")


def test_a_departure_of_all_stations_is_told_once() -> None:
    together, head, other = (check(ECHOES, 0.09, 0.03, station) for station in ("", "head", "torso"))
    sound = replace(other, p_holm=1.0)
    assert condense_departures([together, head, other]) == [together]
    assert condense_departures([together, head, sound]) == [together, head]
    assert condense_departures([replace(together, p_holm=1.0), head, other]) == [head, other]
    assert answer([together, head, other]).endswith("in 3 of 3 checks: share of echoes (3.0 times as much).")


@pytest.mark.parametrize(
    ("one", "text"),
    [
        (check(ECHOES, 0.09, 0.03, "head"), "Share of echoes of head: 9.0 % (8.1 to 9.9), expected 3 %, 3.0 times"),
        (check(ECHOES, 0.015, 0.03), "Share of echoes: 1.50 % (1.35 to 1.65), expected 3 %, 50 % of it."),
        (check("timing.duplicate_share", 0.01, 0.0), "1.0 % (0.9 to 1.1), expected 0 %."),
        (check("timing.rate_hz", 40.5, 40.0, share=0.001), "expected 40 Hz."),
        (check("components.clock.drift_ppm", -30.0, 20.0, share=0.03), "20 ppm."),
        (check("timing.jitter_s", 0.02, 0.001), ", 20 times as much."),
    ],
)
def test_a_departure_has_its_interval_what_was_expected_and_a_ratio_that_says_something(
    one: Departure, text: str
) -> None:
    (said,) = departure_texts([one])
    assert text in said
    assert text.endswith(".") <= said.endswith(text)
