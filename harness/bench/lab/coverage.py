"""Coverage of a lab's measurements: in how many captures of a known unit each interval contains the true parameter."""

from collections.abc import Sequence

from harness.bench.lab.outcomes import CaptureOutcome
from harness.results.benchmark_statement import BenchmarkStatement, state_verdict
from harness.study.trust.characterization import preset_values

LEAST, MOST = 0.90, 0.99
"""Shares of the captures between which the coverage of a 95 % interval has to lie."""


def coverage_rows(outcomes: Sequence[CaptureOutcome]) -> list[BenchmarkStatement]:
    """One row for each parameter that was measured in any of the captures without a fault.

    The true parameters are those of the preset `default`, with which the captures were made.
    """
    known = {key: number.value for key, number in preset_values().items()}
    found: dict[str, list[bool]] = {}
    for outcome in outcomes:
        for number in outcome.parameters:
            if number.key in known:
                found.setdefault(number.key, []).append(number.contains(known[number.key]))
    return [coverage_row(key, covered, len(outcomes)) for key, covered in found.items()]


def coverage_row(key: str, covered: Sequence[bool], captures: int) -> BenchmarkStatement:
    """The row of a parameter whose interval contains the true value or not in the captures that measured it."""
    count, share = sum(covered), sum(covered) / len(covered)
    note = "" if len(covered) == captures else f"not measured in {captures - len(covered)} of {captures}"
    return state_verdict(
        f"coverage, {key}",
        f"in {LEAST:.0%} to {MOST:.0%} of {len(covered)}",
        f"in {count} ({share:.1%})",
        LEAST <= share <= MOST,
        "",
        note,
    )
