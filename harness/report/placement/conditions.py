"""The stability of a placement: the best sets, the ranks and the order of pairs under each condition."""

from collections.abc import Sequence
from functools import partial

from harness.core.number_format import NOT_MEASURED, Interval, count_noun, format_share
from harness.report.kit.page import Block, BrowserOnly, DataTable, Drawing, Prose, Stack, TerminalOnly
from harness.report.placement.charts import stability_chart
from harness.report.placement.tables import MOST_PRINTED
from harness.report.placement.wording import changes_sentence, ranks_by_condition, set_name
from harness.results.findings import PlacementCondition, PlacementFindings, RankAgreement

_MOST_RANKED = 40


def condition_blocks(findings: PlacementFindings) -> list[Block]:
    """The best set of each size under each condition, and the agreement of each pair of conditions."""
    if not findings.conditions:
        return []
    sizes = sorted({int(size) for condition in findings.conditions for size in condition.best})
    rows = [
        [
            Stack(c.name, f"{c.kind}, {count_noun(c.clips, 'unit')}{_stability_note(c)}"),
            *(set_name(c.best[str(size)]) if str(size) in c.best else "" for size in sizes),
        ]
        for c in findings.conditions
    ]
    head = ["condition", *(count_noun(n, "station") for n in sizes)]
    own = findings.conditions[0].name
    printed = [pair for pair in findings.agreements if own in (pair.a, pair.b)]
    more = len(findings.agreements) - len(printed)
    note = [Prose(f"Pairs of conditions that are on the page alone: {more}.")] if more else []
    several = len(findings.conditions) > 1
    return [
        *([Drawing(partial(stability_chart, findings))] if several else []),
        DataTable(head, rows, caption="The best set of each size.", label="elsewhere"),
        _ranks_table(findings),
        BrowserOnly([_agreement_table(findings, findings.agreements)], "All pairs of conditions"),
        TerminalOnly([_agreement_table(findings, printed), *note]),
    ]


def _agreement_table(findings: PlacementFindings, pairs: Sequence[RankAgreement]) -> DataTable:
    rows = [
        [
            f"{pair.a} and {pair.b}",
            Interval.of(pair.tau, pair.low, pair.high),
            f"{pair.sets:,}",
            changes_sentence(findings, pair),
        ]
        for pair in pairs
    ]
    caption = (
        "A change of order is significant if the change of the difference between the two sets is: sign flips over "
        "units, corrected for all pairs of sets (Holm 1979)."
    )
    return DataTable(["pair", "Kendall's tau", "sets", "changes of order"], rows, caption=caption, label="agreement")


def _ranks_table(findings: PlacementFindings) -> DataTable:
    """The rank of each compared set under each condition."""
    rows = [
        [set_name(names), *(NOT_MEASURED if rank is None else rank for rank in ranks)]
        for names, ranks in ranks_by_condition(findings, _MOST_RANKED)
    ]
    caption = "Rank of each set by its mean error under each condition."
    head = ["rank of the set under each condition", *(condition.name for condition in findings.conditions)]
    return DataTable(
        head,
        rows,
        caption=caption,
        label="ranks",
        most_printed=MOST_PRINTED,
        omitted=len(findings.compared) - len(rows),
    )


def _stability_note(condition: PlacementCondition) -> str:
    if condition.selection_stability is None:
        return ""
    return f"; the best set stays best in {format_share(condition.selection_stability)} of resamples"
