"""The departures that are named: those that remain significant after Holm's correction over all checks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from harness.compare.significance import SIGNIFICANCE, holm
from harness.core.interval import Interval
from harness.measure.departures import Departure, compare_with_expected


@dataclass(frozen=True)
class NamedDeparture:
    """A check with its corrected p-value."""

    departure: Departure
    p_holm: float
    """p-value corrected for the number of checks (Holm 1979)."""

    @property
    def is_named(self) -> bool:
        """Whether the measured number differs from the expected one at the 5 % level over all checks."""
        return self.p_holm <= SIGNIFICANCE

    @property
    def ratio(self) -> float:
        """Measured over expected number; infinite where nothing was expected."""
        expected = self.departure.expected.value
        return self.departure.measured.value / expected if expected else float("inf")


def check_departures(
    measured: Mapping[tuple[str, str], Interval], expected: Mapping[tuple[str, str], Interval]
) -> list[NamedDeparture]:
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


def correct_departures(checks: Sequence[Departure]) -> list[NamedDeparture]:
    """The checks with their p-values corrected for their number."""
    corrected = holm([check.p for check in checks])
    return [NamedDeparture(check, p) for check, p in zip(checks, corrected, strict=True)]
