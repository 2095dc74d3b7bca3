"""A trust study in words: the verdict first, then what each part shows."""

from collections import Counter
from collections.abc import Mapping, Sequence

from harness.core.number_format import count_noun, decimals_for, format_fixed, format_interval
from harness.errors import Outcome
from harness.report.kit.metric_labels import metric_label, quantity
from harness.report.kit.text import list_first
from harness.results.trust_findings import (
    Equivalence,
    EquivalenceVerdict,
    PairAgreement,
    PairVerdict,
    RankCorrelation,
    SideDifference,
    TrustFindings,
)
from harness.score.metrics import DEFINITIONS

OUTCOME_TITLES: Mapping[Outcome, str] = {
    Outcome.PASS: "Pass",
    Outcome.REGRESSED: "Contradicted",
    Outcome.NOT_COMPARABLE: "Cannot tell",
    Outcome.INCOMPLETE: "Incomplete",
}
PAIR_MARKS: Mapping[PairVerdict, str] = {"contradict": "✗", "cannot tell": "?", "agree": "✓"}
"""Verdict on a pair -> its mark, in the order of importance to the reader."""
PAIR_MEANINGS: Mapping[PairVerdict, str] = {
    "contradict": "both sides show a difference, in opposite directions",
    "cannot tell": "at least one side shows no difference, or there are too few units",
    "agree": "both sides show a difference in the same direction",
}
EQUIVALENCE_MARKS: Mapping[EquivalenceVerdict, str] = {
    "beyond the margin": "✗",
    "cannot tell": "?",
    "equivalent": "✓",
}
EXPLORATORY = "Exploratory: captures were not made for this plan, so that the figures confirm nothing."
_MOST_DECIMALS = 5


def verdict_sentence(findings: TrustFindings) -> str:
    """The verdict in one sentence."""
    pairs = count_pairs(findings.pairs)
    counted = f"{count_noun(len(findings.pairs), 'pair')} of methods on {count_noun(len(clips(findings)), 'clip')}"
    if (units := max((pair.clips for pair in findings.pairs), default=0)) < len(clips(findings)):
        counted += f" ({count_noun(units, 'unit')} of statistics)"
    match findings.outcome:
        case Outcome.PASS:
            return f"The simulation ranks methods as the device does: of {counted}, none contradicts."
        case Outcome.REGRESSED:
            return f"The simulation {_what_differs(findings)}."
        case Outcome.INCOMPLETE:
            failed = count_noun(len(findings.failures), "cell")
            return f"The study is incomplete: {failed} failed ({list_first(list(findings.failures))})."
        case _ if not findings.pairs:
            return "It cannot be told whether the simulation ranks methods as the device does: nothing was compared."
        case _:
            undecided = pairs["cannot tell"]
            rest = f"{undecided} of {counted} {'is' if undecided == 1 else 'are'} undecided"
            return f"It cannot be told whether the simulation ranks methods as the device does: {rest}."


def _what_differs(findings: TrustFindings) -> str:
    """Pairs that contradict, and metrics beyond their margin."""
    pairs = [pair_title(pair) for pair in findings.pairs if pair.verdict == "contradict"]
    beyond = [
        f"{one.arm} {quantity(one.metric)}" for one in findings.equivalences if one.verdict == "beyond the margin"
    ]
    parts = []
    if pairs:
        of = f"{len(pairs)} of {count_noun(len(findings.pairs), 'pair')} of methods"
        parts.append(f"contradicts the device in {of} ({list_first(pairs)})")
    if beyond:
        of = f"{len(beyond)} of {count_noun(len(findings.equivalences), 'metric')}"
        parts.append(f"differs from the device beyond the margin in {of} ({list_first(beyond)})")
    return " and ".join(parts)


def metric_title(metric: str) -> str:
    """The metric with its unit; a metric that has no definition by its name."""
    return metric_label(metric) if metric in DEFINITIONS else metric


def interval_title(findings: TrustFindings) -> str:
    """Head of a column of intervals: those of two one-sided tests at the level of the plan."""
    return f"{100.0 * (1.0 - 2.0 * findings.level):g} % interval"


def simulated_with(findings: TrustFindings) -> str:
    """The unit file with its digest, or the noise preset."""
    if findings.unit_digest:
        return f"{findings.unit}, digest {findings.unit_digest[:12]}"
    return f"noise {findings.unit}"


def clips(findings: TrustFindings) -> list[str]:
    """The clips that were captured, each once."""
    return list(dict.fromkeys(capture.clip for capture in findings.captures))


def count_pairs(pairs: Sequence[PairAgreement]) -> dict[PairVerdict, int]:
    """Verdict -> number of pairs, the most important verdict first."""
    counts = Counter(pair.verdict for pair in pairs)
    return {verdict: counts[verdict] for verdict in PAIR_MARKS}


def pair_title(pair: PairAgreement) -> str:
    """The two arms of a pair."""
    return f"{pair.a} against {pair.b}"


def sort_pairs(pairs: Sequence[PairAgreement]) -> list[PairAgreement]:
    """The pairs sorted by verdict, contradictions first; pairs of one verdict keep their order."""
    order = list(PAIR_MARKS)
    return sorted(pairs, key=lambda pair: order.index(pair.verdict))


def sort_equivalences(rows: Sequence[Equivalence]) -> list[Equivalence]:
    """The rows sorted by verdict, those beyond the margin first."""
    order = list(EQUIVALENCE_MARKS)
    return sorted(rows, key=lambda row: order.index(row.verdict))


def side_text(side: SideDifference) -> str:
    """Mean difference of one side with its sign; a dash without one."""
    return "–" if side.mean is None else format_fixed(side.mean, _side_decimals(side), signed=True)


def side_interval(side: SideDifference) -> str:
    """The interval of a side; a dash without one."""
    return format_interval(side.low, side.high, _side_decimals(side), signed=True) or "–"


def _side_decimals(side: SideDifference) -> int:
    width = side.high - side.low if side.low is not None and side.high is not None else None
    return decimals_for(width or side.mean, digits=2, most=_MOST_DECIMALS)


def equivalence_decimals(row: Equivalence) -> int:
    """Decimals that show two digits of the interval's width, or of the margin where that is smaller."""
    width = row.high - row.low if row.low is not None and row.high is not None else None
    return decimals_for(width, row.margin, digits=2, most=_MOST_DECIMALS)


def correlation_text(one: RankCorrelation) -> str:
    """A correlation of ranks with its interval, or why there is none."""
    name = f"{one.name[0].upper()}{one.name[1:]}"
    if one.value is None:
        return f"{name}: not measured ({one.reason})"
    interval = format_interval(one.low, one.high, 2)
    return f"{name} {format_fixed(one.value, 2)}" + (f" ({interval})" if interval else "")
