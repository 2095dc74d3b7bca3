"""Evaluation of a paper's claims with errors by clip."""

from collections.abc import Mapping
from dataclasses import replace

from harness.compare.paired_statistics import compare_paired
from harness.results.findings import Claim

Errors = Mapping[str, float]
"""Clip -> error; all clips are of one kind."""
TOLERANCE = 0.25
"""Largest relative difference to a published figure that counts as reproduced."""


def claim_lower_error(
    text: str, less: Errors, more: Errors, *, published: str = "order", unit: str = "deg", why: str = ""
) -> Claim:
    """Claim that `less` is below `more`, tested by the paired interval.

    `why` explains a claim that is not reproduced.
    """
    difference = compare_paired(more, less)
    if difference.mean is None:
        return Claim(text, published, "not measured", "not run", difference.why, unit=unit)
    means = [sum(side[clip] for clip in difference.clips) / len(difference.clips) for side in (less, more)]
    return Claim(
        text=text,
        published=published,
        ours=f"{means[0]:.2f} against {means[1]:.2f} {unit}",
        verdict=difference.verdict,
        why="" if difference.verdict == "reproduced" else "; ".join(filter(None, (difference.why, why))),
        clips=len(difference.clips),
        difference=difference.mean,
        low=difference.low,
        high=difference.high,
        unit=unit,
    )


def claim_published_value(
    text: str, published: float, errors: Errors, *, comparable: bool, why: str, unit: str = "deg"
) -> Claim:
    """Claim that the mean error is the published figure, within `TOLERANCE`; `why` says why it is not `comparable`.

    The means are compared directly, since figures from two motion libraries have no paired difference.
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
