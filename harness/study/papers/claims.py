"""Claims of a paper held against errors by clip."""

from collections.abc import Mapping
from dataclasses import replace

from harness.compare.paired_statistics import compare_paired
from harness.results.findings import Claim

Errors = Mapping[str, float]
"""Clip -> error, of clips of one kind."""
TOLERANCE = 0.25
"""Within which share of a published figure ours counts as the same."""


def claim_lower_error(
    text: str, less: Errors, more: Errors, *, published: str = "order", unit: str = "deg", why: str = ""
) -> Claim:
    """That `less` is below `more`, by the paired interval of their difference; `why` says what is known where not."""
    found = compare_paired(more, less)
    if found.mean is None:
        return Claim(text, published, "not measured", "not run", found.why, unit=unit)
    means = [sum(side[clip] for clip in found.clips) / len(found.clips) for side in (less, more)]
    return Claim(
        text=text,
        published=published,
        ours=f"{means[0]:.2f} against {means[1]:.2f} {unit}",
        verdict=found.verdict,
        why="" if found.verdict == "reproduced" else "; ".join(filter(None, (found.why, why))),
        clips=len(found.clips),
        difference=found.mean,
        low=found.low,
        high=found.high,
        unit=unit,
    )


def claim_published_value(
    text: str, published: float, errors: Errors, *, comparable: bool, why: str, unit: str = "deg"
) -> Claim:
    """That the mean of errors is the published figure, within a quarter of it; `why` it is not `comparable`.

    What is judged is the mean itself: two figures from two libraries have no paired difference.
    """
    claim = Claim(text, f"{published:g} {unit}", "not measured", "not run", "no clip was measured", unit=unit)
    if not errors:
        return claim
    mean = sum(errors.values()) / len(errors)
    claim = replace(claim, ours=f"{mean:.2f} {unit}", clips=len(errors), difference=mean, why=why)
    if not comparable:
        return replace(claim, verdict="not comparable")
    off = mean / published - 1.0
    if abs(off) <= TOLERANCE:
        return replace(claim, verdict="reproduced", why=f"{off:+.0%}, within {TOLERANCE:.0%}")
    return replace(claim, verdict="not reproduced", why=f"{off:+.0%}, beyond {TOLERANCE:.0%}; {why}".removesuffix("; "))
