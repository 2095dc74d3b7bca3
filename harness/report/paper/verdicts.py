"""Verdicts on a paper's claims: their meaning, and their counts in words."""

from collections import Counter
from collections.abc import Iterable, Mapping

from harness.core.number_format import count_noun
from harness.results.benchmark_statement import BenchmarkStatement, Reading, Verdict
from harness.results.findings import PaperExperiment, PaperFindings

READINGS: Mapping[Reading, str] = {"as printed": "With the methods as printed: ", "ours": "With our methods: "}
"""Reading -> start of its sentence."""
MEANINGS: Mapping[Verdict, str] = {
    "reproduced": "the 95 % interval of the paired difference lies on the published side, and its p after Holm is at "
    "most 0.05; or a printed value is met (an error within 25 %)",
    "same": "the whole interval lies within the margin of a comparison: the difference is too small to matter",
    "not reproduced": "the interval lies on the other side; or a printed value is not met",
    "cannot tell": "the interval contains zero, there are too few units, or the difference is not significant among "
    "the printed statements (Holm)",
    "not comparable": "the printed value is for other motion or conditions",
    "not run": "not measured here",
}
KINDS: tuple[Verdict, ...] = tuple(MEANINGS)
"""All verdicts on claims, in the order of the tables."""


def all_claims(findings: PaperFindings) -> list[BenchmarkStatement]:
    """The claims of all experiments, in their order."""
    return [claim for experiment in findings.experiments for claim in experiment.claims]


def count_verdicts(claims: list[BenchmarkStatement]) -> dict[Verdict, int]:
    """Verdict -> number of claims; "not run" is left out if there are none."""
    counts = Counter(claim.verdict for claim in claims)
    return {kind: counts[kind] for kind in KINDS if counts[kind] or kind != "not run"}


def printed_claims(claims: Iterable[BenchmarkStatement], reading: Reading) -> list[BenchmarkStatement]:
    """The claims of statements that the paper prints, with the methods of one reading; those of no method are of both.

    A reading without any claim of its own has none.
    """
    found = [claim for claim in claims if claim.kind == "printed" and claim.reading in ("", reading)]
    return found if any(claim.reading == reading for claim in found) else []


def sentence(claims: list[BenchmarkStatement]) -> str:
    """The number of printed statements of each verdict: with the methods as printed, and with ours."""
    readings = {reading: printed_claims(claims, reading) for reading in READINGS}
    found = {READINGS[reading]: some for reading, some in readings.items() if some}
    if not found and claims:
        found = {"": [claim for claim in claims if claim.kind == "printed"] or claims}
    if not found:
        return "No published statement was compared with a measured result."
    return " ".join(f"{_counts(some, start)}." for start, some in found.items())


def _counts(claims: list[BenchmarkStatement], start: str) -> str:
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
