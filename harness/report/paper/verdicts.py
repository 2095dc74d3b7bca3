"""What became of a paper's statements, counted and in words, and in what the experiments differ."""

import math
from collections import Counter
from collections.abc import Mapping
from typing import get_args

from harness.report.run.tables import format_number
from harness.results.findings import Claim, ClaimVerdict, PaperExperiment, PaperFindings

KINDS: tuple[ClaimVerdict, ...] = get_args(ClaimVerdict)
MARKS: Mapping[ClaimVerdict, str] = {
    "reproduced": "✓",
    "not reproduced": "✗",
    "cannot tell": "?",
    "not comparable": "≠",
    "not run": "–",
}
MEANINGS: Mapping[ClaimVerdict, str] = {
    "reproduced": "the 95 % interval of the paired difference lies on the published side; or a printed figure is "
    "met, an error within 25 %",
    "not reproduced": "the interval lies on the other side; or a printed figure is missed",
    "cannot tell": "the interval holds zero, or there are fewer than 6 clips to take one from",
    "not comparable": "a printed figure is of other motion or conditions than ours",
    "not run": "not measured here",
}
MINUS = "−"
_MOST_DECIMALS = 4


def all_claims(findings: PaperFindings) -> list[Claim]:
    """Of all experiments, in their order."""
    return [claim for experiment in findings.experiments for claim in experiment.claims]


def count_verdicts(found: list[Claim]) -> dict[ClaimVerdict, int]:
    """How many have each verdict; the first four always, *not run* where there are any."""
    counts = Counter(claim.verdict for claim in found)
    return {kind: counts[kind] for kind in KINDS if counts[kind] or kind != "not run"}


def sentence(found: list[Claim]) -> str:
    """What a reader should know first, in the words of the verdicts."""
    if not found:
        return "No published statement was held against a figure of ours."
    first, *others = count_verdicts(found).items()
    start = f"{first[1]} of {len(found)} published statement{'s'[: len(found) != 1]} {first[0]}"
    return f"{', '.join([start, *(f'{count} {kind}' for kind, count in others if count)])}."


def shared_differences(findings: PaperFindings) -> dict[str, list[PaperExperiment]]:
    """What several experiments differ from the paper in -> which: it is told once."""
    found: dict[str, list[PaperExperiment]] = {}
    for experiment in findings.experiments:
        for text in dict.fromkeys(experiment.differences):
            found.setdefault(text, []).append(experiment)
    return {text: those for text, those in found.items() if len(those) > 1}


def format_difference(claim: Claim) -> str:
    """The mean difference with its unit, "" where there is none or `ours` has this very figure."""
    if claim.difference is None:
        return ""
    text = f"{_format_number(claim.difference, claim)} {claim.unit}".rstrip()
    return "" if claim.low is None and f" {text}" in f" {claim.ours}" else text


def format_interval(claim: Claim) -> str:
    """From the lower to the upper end, "" where it was not taken."""
    if claim.low is None or claim.high is None:
        return ""
    return f"{_format_number(claim.low, claim)} to {_format_number(claim.high, claim)}"


def _format_number(value: float, claim: Claim) -> str:
    """With as many decimals as the smallest of the three needs, so that no end that is not zero reads 0.00."""
    finest = min((abs(v) for v in (claim.difference, claim.low, claim.high) if v), default=1.0)
    decimals = min(_MOST_DECIMALS, math.ceil(-math.log10(finest)))
    return format_number(value, claim.unit, decimals=decimals).replace("-", MINUS)
