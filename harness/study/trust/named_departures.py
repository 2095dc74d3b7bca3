"""The departures that are named: those that remain significant after Holm's correction over all checks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from harness.compare.significance import holm
from harness.core.number_format import Interval
from harness.measure.departures import Departure, compare_with_expected


def check_departures(
    measured: Mapping[tuple[str, str], Interval], expected: Mapping[tuple[str, str], Interval]
) -> list[Departure]:
    """Compare every number that was measured and is expected; both map (key, station) to a number.

    A station's number whose own expectation is missing is compared with that of all stations (station ""). The result
    is in the order of `measured`, with p-values that Holm's correction over all checks has raised.
    """
    checks = []
    for (key, station), number in measured.items():
        reference = expected.get((key, station), expected.get((key, "")))
        if number.is_measured and reference is not None and reference.is_measured:
            checks.append(compare_with_expected(key, station, number, reference))
    return correct_departures(checks)


def correct_departures(checks: Sequence[Departure]) -> list[Departure]:
    """The checks with their p-values corrected for their number."""
    corrected = holm([check.p for check in checks])
    return [replace(check, p_holm=p) for check, p in zip(checks, corrected, strict=True)]
