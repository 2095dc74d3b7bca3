"""Verdicts on a paper's claims: their meaning, their counts in words, and the format of differences."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import get_args

from harness.core.number_format import count_noun, decimals_for, format_number
from harness.results.findings import Claim, ClaimVerdict, PaperExperiment, PaperFindings, Reading

READINGS: Mapping[Reading, str] = {"as printed": "With the methods as printed: ", "ours": "With our methods: "}
"""Reading -> start of its sentence."""
KINDS: tuple[ClaimVerdict, ...] = get_args(ClaimVerdict)
"""All verdicts, in the order of the tables."""
MARKS: Mapping[ClaimVerdict, str] = {
    "reproduced": "✓",
    "same": "=",
    "not reproduced": "✗",
    "cannot tell": "?",
    "not comparable": "≠",
    "not run": "–",
}
MEANINGS: Mapping[ClaimVerdict, str] = {
    "reproduced": "the 95 % interval of the paired difference lies on the published side, and its p after Holm is at "
    "most 0.05; or a printed value is met (an error within 25 %)",
    "same": "the whole interval lies within the margin of a comparison: the difference is too small to matter",
    "not reproduced": "the interval lies on the other side; or a printed value is not met",
    "cannot tell": "the interval contains zero, there are too few units, or the difference is not significant among "
    "the printed statements (Holm)",
    "not comparable": "the printed value is for other motion or conditions",
    "not run": "not measured here",
}


def all_claims(findings: PaperFindings) -> list[Claim]:
    """The claims of all experiments, in their order."""
    return [claim for experiment in findings.experiments for claim in experiment.claims]


def count_verdicts(claims: list[Claim]) -> dict[ClaimVerdict, int]:
    """Verdict -> number of claims; "not run" is left out if there are none."""
    counts = Counter(claim.verdict for claim in claims)
    return {kind: counts[kind] for kind in KINDS if counts[kind] or kind != "not run"}


def printed_claims(claims: Iterable[Claim], reading: Reading) -> list[Claim]:
    """The claims of statements that the paper prints, with the methods of one reading; those of no method are of both.

    A reading without any claim of its own has none.
    """
    found = [claim for claim in claims if claim.kind == "printed" and claim.reading in ("", reading)]
    return found if any(claim.reading == reading for claim in found) else []


def sentence(claims: list[Claim]) -> str:
    """The number of printed statements of each verdict: with the methods as printed, and with ours."""
    readings = {reading: printed_claims(claims, reading) for reading in READINGS}
    found = {READINGS[reading]: some for reading, some in readings.items() if some}
    if not found and claims:
        found = {"": [claim for claim in claims if claim.kind == "printed"] or claims}
    if not found:
        return "No published statement was compared with a measured result."
    return " ".join(f"{_counts(some, start)}." for start, some in found.items())


def _counts(claims: list[Claim], start: str) -> str:
    first, *others = count_verdicts(claims).items()
    counted = f"{start}{first[1]} of {count_noun(len(claims), 'printed statement')} {first[0]}"
    return ", ".join([counted, *(f"{count} {kind}" for kind, count in others if count)])


def shared_differences(findings: PaperFindings) -> dict[str, list[PaperExperiment]]:
    """Difference from the paper -> the experiments that share it, for those that several experiments share."""
    experiments_of: dict[str, list[PaperExperiment]] = {}
    for experiment in findings.experiments:
        for text in dict.fromkeys(experiment.differences):
            experiments_of.setdefault(text, []).append(experiment)
    return {text: experiments for text, experiments in experiments_of.items() if len(experiments) > 1}


def format_kind(claim: Claim) -> str:
    """Kind and reading of a claim, such as "printed, ours"."""
    return ", ".join(filter(None, (claim.kind, claim.reading)))


def format_difference(claim: Claim) -> str:
    """The mean difference with its unit; "" where there is none or `ours` already shows the same number."""
    if claim.difference is None:
        return ""
    text = f"{_format_number(claim.difference, claim)} {claim.unit}".rstrip()
    return "" if claim.low is None and f" {text}" in f" {claim.ours}" else text


def format_interval(claim: Claim) -> str:
    """The interval, "−0.20 to 0.31"; "" where it was not computed."""
    if claim.low is None or claim.high is None:
        return ""
    return f"{_format_number(claim.low, claim)} to {_format_number(claim.high, claim)}"


def format_p(claim: Claim) -> str:
    """The p of a printed statement after Holm's correction, such as "0.012"; "" where there is none."""
    if claim.p_holm is None:
        return ""
    return "< 0.001" if claim.p_holm < 0.001 else f"{claim.p_holm:.3f}"


def _format_number(value: float, claim: Claim) -> str:
    """A number with the decimals that the smallest of difference and ends needs not to read 0.00."""
    return format_number(value, claim.unit, decimals=decimals_for(claim.difference, claim.low, claim.high))
