"""The page of a trust study: the verdict, the pairs of methods, then what the simulation gets right and wrong."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial

from harness.core.number_format import (
    NOT_MEASURED,
    Interval,
    count_noun,
    format_fixed,
    format_number,
    format_p_value,
    format_share,
)
from harness.errors import Outcome
from harness.report.kit.page import (
    Badge,
    Bullets,
    DataTable,
    Drawing,
    Page,
    Prose,
    Section,
    Tally,
)
from harness.report.kit.text import last_line, list_first, metric_name
from harness.report.lab.trust_charts import (
    distances_chart,
    equivalence_chart,
    interval_title,
    metric_title,
    pair_title,
    pairs_chart,
    ranks_chart,
    side_interval,
    sort_equivalences,
    sort_pairs,
)
from harness.results.findings import (
    EquivalenceVerdict,
    ErrorDistance,
    PairAgreement,
    PairVerdict,
    StreamHealth,
    TrustFindings,
)
from harness.score import DEFINITIONS

OUTCOME_TITLES: Mapping[Outcome, str] = {
    Outcome.PASS: "Pass",
    Outcome.REGRESSED: "Differs",
    Outcome.NOT_COMPARABLE: "Cannot tell",
    Outcome.INCOMPLETE: "Incomplete",
}
_PAIR_MARKS: Mapping[PairVerdict, str] = {"contradict": "✗", "cannot tell": "?", "agree": "✓"}
_PAIR_MEANINGS: Mapping[PairVerdict, str] = {
    "contradict": "both sides show a difference, in opposite directions",
    "cannot tell": "at least one side shows no difference, or there are too few units",
    "agree": "both sides show a difference in the same direction",
}
_EQUIVALENCE_MARKS: Mapping[EquivalenceVerdict, str] = {"beyond the margin": "✗", "cannot tell": "?", "equivalent": "✓"}
_EXPLORATORY = "Exploratory: captures were not made for this plan, so that the figures confirm nothing."
_UNITS = {"m": ("mm", 1e3), "rad": ("deg", math.degrees(1.0))}
"""Unit of an error -> the one that is shown, and its factor."""
_HEALTH = ("rate [Hz]", "frames lost", "gaps per minute", "mean gap [s]", "mean quality", "frames in doubt")


def trust_page(found: TrustFindings, command: str) -> Page:
    """The page of a trust study that `command` made."""
    names = clips(found)
    simulated = f"{found.unit}, digest {found.unit_digest[:12]}" if found.unit_digest else f"noise {found.unit}"
    failures = [f"{cell}: {last_line(why)}" for cell, why in found.failures.items()]
    damage = [f"{capture.file}: {text}" for capture in found.captures for text in capture.damage]
    return Page(
        verb="trust",
        name=found.title,
        verdict=(OUTCOME_TITLES[found.outcome], found.outcome),
        headline=verdict_sentence(found),
        lead=[
            *([Prose(_EXPLORATORY, is_warning=True)] if found.exploratory else []),
            *([Tally(count_pairs(found.pairs), _PAIR_MARKS, _PAIR_MEANINGS)] if found.pairs else []),
        ],
        facts={
            "Methods": list_first(found.arms, 8, "; "),
            "Motion": f"{count_noun(len(names), 'clip')}: {list_first(names, 4)}" if names else "none",
            "Captures": f"{len(found.captures):,}",
            "Simulated with": simulated,
            "Scenario": found.scenario,
            "Ranked by": metric_title(found.ranked_metric),
            "Plan": f"digest {found.plan_digest[:12]}",
            "Level": f"{found.level:g}; simulated errors of {count_noun(len(found.seeds), 'seed')}",
            "Failed": list_first(failures),
        },
        sections=[
            Section("Pairs", "pairs", [Drawing(partial(pairs_chart, found)), _pairs_table(found)]),
            Section("Ranks", "ranks", [Drawing(partial(ranks_chart, found)), Bullets(correlations(found), prefix="")]),
            Section("Margins", "equivalence", [Drawing(partial(equivalence_chart, found), _equivalence_table(found))]),
            Section(
                "Distance of the errors",
                "distances",
                [Drawing(partial(distances_chart, found), _distances_table(found))],
            ),
            Section("Stream health", "health", [_health_table(found)]),
            Section("Captures", "captures", [_captures_table(found), Bullets([*damage, *failures, *found.notes])]),
        ],
        command=command,
    )


def verdict_sentence(findings: TrustFindings) -> str:
    """The verdict and its reason in one sentence."""
    pairs = count_pairs(findings.pairs)
    counted = f"{count_noun(len(findings.pairs), 'pair')} of methods on {count_noun(len(clips(findings)), 'clip')}"
    if (units := max((pair.clips for pair in findings.pairs), default=0)) < len(clips(findings)):
        counted += f" ({count_noun(units, 'unit')} of statistics)"
    match findings.outcome:
        case Outcome.PASS:
            return f"The simulation ranks methods as the device does ({counted}): {findings.why}"
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
            return f"It cannot be told whether the simulation ranks methods as the device does ({rest}): {findings.why}"


def _what_differs(findings: TrustFindings) -> str:
    """Pairs that contradict, and metrics beyond their margin."""
    pairs = [pair_title(pair) for pair in findings.pairs if pair.verdict == "contradict"]
    beyond = [
        f"{metric_name(one.metric)} of {one.arm}" for one in findings.equivalences if one.verdict == "beyond the margin"
    ]
    parts = []
    if pairs:
        of = f"{len(pairs)} of {count_noun(len(findings.pairs), 'pair')} of methods"
        parts.append(f"contradicts the device in {of} ({list_first(pairs, separator='; ')})")
    if beyond:
        of = f"{len(beyond)} of {count_noun(len(findings.equivalences), 'metric')}"
        parts.append(f"differs from the device beyond the margin in {of} ({list_first(beyond, separator='; ')})")
    return " and ".join(parts)


def clips(findings: TrustFindings) -> list[str]:
    """The clips that were captured, each once."""
    return list(dict.fromkeys(capture.clip for capture in findings.captures))


def count_pairs(pairs: Sequence[PairAgreement]) -> dict[PairVerdict, int]:
    """Verdict -> number of pairs, the most important verdict first."""
    counts = Counter(pair.verdict for pair in pairs)
    return {verdict: counts[verdict] for verdict in _PAIR_MARKS}


def correlations(findings: TrustFindings) -> list[str]:
    """Each correlation of ranks with its interval, or why there is none."""
    return [
        f"{one.name[0].upper()}{one.name[1:]}: not measured ({one.reason})."
        if one.value is None
        else f"{one.name[0].upper()}{one.name[1:]} {Interval.of(one.value, one.low, one.high)}."
        for one in findings.rank_correlations
    ]


def _pairs_table(found: TrustFindings) -> DataTable:
    """Both sides of each pair, contradictions first."""
    rows = [
        [
            pair_title(pair),
            Badge(pair.verdict, _PAIR_MARKS[pair.verdict], pair.why),
            side_interval(pair.device),
            side_interval(pair.simulated),
            format_p_value(pair.p_holm),
            pair.clips,
        ]
        for pair in sort_pairs(found.pairs)
    ]
    caption = (
        f"Error of the first method minus that of the second in {metric_title(found.ranked_metric)}, over units, with "
        f"its {interval_title(found)}. p is the larger one of the two sides, after Holm's correction for the number of "
        "pairs."
    )
    return DataTable(["pair", "verdict", "device", "simulation", "p (Holm)", "units"], rows, caption=caption)


def _equivalence_table(found: TrustFindings) -> DataTable:
    """Simulation minus device of each metric of each arm, those beyond the margin first."""
    rows = [
        [
            one.arm,
            metric_title(one.metric),
            Badge(one.verdict, _EQUIVALENCE_MARKS[one.verdict]),
            _mean(one.device, one.metric),
            _mean(one.simulated, one.metric),
            Interval.of(one.difference, one.low, one.high, signed=True),
            f"{one.margin:g}",
            one.clips,
        ]
        for one in sort_equivalences(found.equivalences)
    ]
    caption = (
        "Two one-sided tests for each metric of each method: simulation minus device with its "
        f"{interval_title(found)}. The margins stand in the plan, which was fixed before the captures."
    )
    head = ["method", "metric", "verdict", "device", "simulation", "difference", "margin", "units"]
    return DataTable(head, rows, caption=caption, label="equivalence")


def _mean(value: float | None, metric: str) -> str:
    return format_number(value, DEFINITIONS[metric].unit if metric in DEFINITIONS else "")


def _distances_table(found: TrustFindings) -> DataTable:
    """Energy distance of each station and error beside the device's own."""
    rows = []
    for one in found.distances:
        unit, factor = _UNITS.get(one.unit, (one.unit, 1.0))
        rows.append(
            [
                one.station,
                f"{one.feature} [{unit}]",
                _distance(one.distance, factor),
                _distance(one.split_half, factor),
                format_p_value(one.p_holm),
                f"{one.blocks[0]} and {one.blocks[1]} of {format_fixed(one.block_s, 1)} s",
                one.reason or _distance_meaning(one, found.level),
            ]
        )
    caption = (
        "Do the errors of the tracker look alike? The energy distance is zero only where two distributions are equal. "
        "Blocks of at least five correlation times are permuted. The distance between random halves of the device's "
        "own captures is the yardstick."
    )
    head = ["station", "error", "distance", "device's own", "p (Holm)", "blocks", "meaning"]
    return DataTable(head, rows, caption=caption, label="distances")


def _distance_meaning(one: ErrorDistance, level: float) -> str:
    """Whether the errors differ, and whether by more than halves of the device's own captures do."""
    if one.distance is None or one.split_half is None or one.p_holm is None:
        return NOT_MEASURED
    if one.p_holm > level:
        return "no difference shown"
    return "differs" if one.distance > one.split_half else "differs by less than halves of the device's data do"


def _distance(value: float | None, factor: float) -> str:
    return NOT_MEASURED if value is None else Interval(factor * value).number


def _health_table(found: TrustFindings) -> DataTable:
    """Stream health of each station on both sides, one below the other."""
    rows = [
        [row.station, side, *_health_cells(health)]
        for row in found.health
        for side, health in (("device", row.device), ("simulation", row.simulated))
    ]
    caption = "The stream of each station on both sides: how often it is lost, for how long, at what quality."
    return DataTable(["station", "side", *_HEALTH], rows, caption=caption)


def _health_cells(health: StreamHealth) -> list[str]:
    return [
        format_fixed(health.rate_hz, 2),
        format_share(health.lost_share, 2),
        format_fixed(health.gaps_per_min, 2),
        "–" if health.gap_s is None else format_fixed(health.gap_s, 3),
        format_fixed(health.quality, 3),
        format_share(health.suspect_share, 2),
    ]


def _captures_table(found: TrustFindings) -> DataTable:
    """The captures, and whether each names this plan."""
    rows = [
        [
            capture.file,
            capture.clip,
            f"{capture.frames:,}",
            "yes" if capture.plan == found.plan_digest else "another plan" if capture.plan else "no plan",
            capture.sha256[:12],
        ]
        for capture in found.captures
    ]
    return DataTable(["capture", "motion", "frames", "made for this plan", "SHA-256 begins"], rows)
