"""Which contributions of candidates can be told from zero, all candidates of a picture taken together."""

from collections.abc import Sequence

from scipy import special

from harness.compare import CONFIDENCE_LEVEL, SIGNIFICANCE, holm
from harness.results.findings import MarginalContribution, StationNames

Group = tuple[MarginalContribution, ...]
"""Contributions that were measured in one way."""
SIGNIFICANCE_NOTE = "Pale: cannot be told from zero, corrected for the number of places (Holm 1979)."
"""What pictures of contributions say about pale marks."""


def significant_candidates(rows: Sequence[MarginalContribution]) -> frozenset[str]:
    """The candidates whose contribution differs from zero, corrected for the number of candidates (Holm 1979).

    The p of a candidate is that of a t test with the standard error that its interval implies. So of candidates that do
    not matter, five in a hundred pictures show one, not five in a hundred candidates.
    """
    measured = [row for row in rows if row.difference is not None and row.low is not None and row.high is not None]
    corrected = holm([_p_value(row) for row in measured])
    return frozenset(row.candidate for row, p in zip(measured, corrected, strict=True) if p <= SIGNIFICANCE)


def _p_value(row: MarginalContribution) -> float:
    """Two-sided p; the half of the interval towards zero has the length of a t interval or more."""
    mean, ends = row.difference or 0.0, (row.low or 0.0, row.high or 0.0)
    half = mean - ends[0] if mean > 0.0 else ends[1] - mean
    if row.clips < 2 or mean == 0.0:
        return 1.0
    if half <= 0.0:
        return 0.0  # every unit has the same difference
    freedom = row.clips - 1
    t = abs(mean) / half * float(special.stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE_LEVEL))
    return float(2.0 * special.stdtr(freedom, -t))


def largest_group(contributions: Sequence[MarginalContribution]) -> Group:
    """The contributions that compare most candidates, those over all sets first; () where none was measured."""
    groups: dict[tuple[str, StationNames], list[MarginalContribution]] = {}
    for row in contributions:
        groups.setdefault((row.mode, row.base), []).append(row)
    measured = [tuple(rows) for rows in groups.values() if any(row.difference is not None for row in rows)]
    return max(measured, key=lambda rows: (len(rows), rows[0].mode == "exhaustive"), default=())
