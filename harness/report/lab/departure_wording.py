"""Departures from expected numbers in words."""

from collections.abc import Sequence

from harness.core.number_format import count_noun, format_fixed
from harness.report.kit.text import list_first
from harness.report.lab.quantities import format_both, format_plain, format_value, quantity
from harness.report.lab.unit_content import DepartureCheck

_CLEAR_RATIO = 0.05
"""A ratio this near to 1 is left out."""


def departures_sentence(name: str, checks: Sequence[DepartureCheck], expected_from: str) -> str:
    """What departs from the expected numbers, in one sentence."""
    counted, found = count_noun(len(checks), "check"), [check for check in checks if check.is_named]
    if not checks:
        return f"{name} was not held to any expected number: nothing that is expected could be measured."
    if not found:
        return f"{name} shows no departure from {expected_from} in {counted}."
    faults = list_first([_fault(check) for check in condense_departures(checks)], 4)
    return f"{name} departs from {expected_from} in {len(found)} of {counted}: {faults}."


def condense_departures(checks: Sequence[DepartureCheck]) -> list[DepartureCheck]:
    """The departures, without those of single stations where all stations depart, together and each."""
    named = [check for check in checks if check.is_named]
    departing = {(check.departure.key, check.departure.station) for check in named}
    common = set()
    for key in {key for key, station in departing if not station}:
        stations = {one.departure.station for one in checks if one.departure.key == key} - {""}
        if len(stations) > 1 and all((key, station) in departing for station in stations):
            common.add(key)
    return [check for check in named if not check.departure.station or check.departure.key not in common]


def _fault(check: DepartureCheck) -> str:
    """Name of a departure, and how many times as large it is as expected."""
    one = check.departure
    shown = quantity(one.key)
    of = f" of {one.station}" if one.station else ""
    ratio = _ratio_text(one.measured.value, one.expected.value).removeprefix(", ")
    return f"{shown.label}{of} ({ratio or format_value(one.measured, shown)})"


def departure_text(check: DepartureCheck) -> str:
    """One departure in words: what, where, how large, and what was expected."""
    if check.text:
        return check.text
    one = check.departure
    shown = quantity(one.key)
    name = f"{shown.label[0].upper()}{shown.label[1:]}" + (f" of {one.station}" if one.station else "")
    number = f"{format_both(one.measured, shown)}, expected {format_plain(one.expected.value, shown)}"
    return f"{name}: {number}{_ratio_text(one.measured.value, one.expected.value)}."


def _ratio_text(measured: float, expected: float) -> str:
    if expected == 0.0 or measured / expected <= 0.0 or abs(measured / expected - 1.0) < _CLEAR_RATIO:
        return ""
    ratio = measured / expected
    if ratio > 1.0:
        return f", {format_fixed(ratio, 1 if ratio < 10.0 else 0)} times as much"
    return f", {format_fixed(100.0 * ratio, 0)} % of it"
