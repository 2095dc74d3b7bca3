"""Departures from expected numbers, in words and as a table, for the pages of a unit and of a validated capture."""

from collections.abc import Sequence

from harness.core.number_format import count_noun, format_fixed, format_p_value
from harness.measure.departures import Departure
from harness.report.kit.page import DataTable
from harness.report.kit.text import list_first
from harness.report.lab.quantities import find_quantity

ALL_STATIONS = "all"
_CLEAR_RATIO = 0.05
"""A ratio this near to 1 is left out."""
_MOST_PRINTED = 8


def departures_sentence(name: str, checks: Sequence[Departure], expected_from: str) -> str:
    """What departs from the expected numbers, in one sentence."""
    counted, found = count_noun(len(checks), "check"), [check for check in checks if check.is_named]
    if not checks:
        return f"No expected number could be compared with {name}."
    if not found:
        return f"{name} shows no departure from {expected_from} in {counted}."
    faults = list_first([_fault(check) for check in condense_departures(checks)], 4)
    return f"{name} departs from {expected_from} in {len(found)} of {counted}: {faults}."


def condense_departures(checks: Sequence[Departure]) -> list[Departure]:
    """The departures, without those of single stations where all stations depart, together and each."""
    named = [check for check in checks if check.is_named]
    departing = {(check.key, check.station) for check in named}
    common = set()
    for key in {key for key, station in departing if not station}:
        stations = {one.station for one in checks if one.key == key} - {""}
        if len(stations) > 1 and all((key, station) in departing for station in stations):
            common.add(key)
    return [check for check in named if not check.station or check.key not in common]


def _fault(check: Departure) -> str:
    """Name of a departure, and how many times as large it is as expected."""
    shown = find_quantity(check.key)
    of = f" of {check.station}" if check.station else ""
    ratio = _ratio_text(check.measured.value, check.expected.value).removeprefix(", ")
    return f"{shown.label}{of} ({ratio or shown.of(check.measured).number})"


def departure_texts(checks: Sequence[Departure]) -> list[str]:
    """Each departure in words: what, where, how large, and what was expected."""
    return [_departure_text(check) for check in condense_departures(checks)]


def _departure_text(check: Departure) -> str:
    shown = find_quantity(check.key)
    name = f"{shown.label[0].upper()}{shown.label[1:]}" + (f" of {check.station}" if check.station else "")
    number = f"{shown.of(check.measured)}, expected {shown.exact(check.expected.value)}"
    return f"{name}: {number}{_ratio_text(check.measured.value, check.expected.value)}."


def _ratio_text(measured: float, expected: float) -> str:
    if expected == 0.0 or measured / expected <= 0.0 or abs(measured / expected - 1.0) < _CLEAR_RATIO:
        return ""
    ratio = measured / expected
    if ratio > 1.0:
        return f", {format_fixed(ratio, 1 if ratio < 10.0 else 0)} times as much"
    return f", {format_fixed(100.0 * ratio, 0)} % of it"


def departures_table(checks: Sequence[Departure]) -> DataTable:
    """Measured and expected numbers of checks, the least likely first."""
    rows = [
        [
            find_quantity(check.key).label,
            check.station or ALL_STATIONS,
            find_quantity(check.key).of(check.measured),
            find_quantity(check.key).exact(check.expected.value),
            format_p_value(check.p),
            format_p_value(check.p_holm),
        ]
        for check in sorted(checks, key=lambda check: (check.p_holm, check.p))
    ]
    return DataTable(
        ["number", "station", "measured", "expected", "p", "p (Holm)"],
        rows,
        caption="The least likely first. Below the numbers: 95 % intervals. A departure has a p of at most 0.05 after "
        "Holm's correction for the number of checks.",
        most_printed=max(_MOST_PRINTED, sum(check.is_named for check in checks)),
    )
