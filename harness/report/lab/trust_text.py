"""A trust study as text for the terminal: the verdict first, then tables."""

from harness.core.number_format import count_noun
from harness.core.text_table import Table
from harness.report.kit.text import last_line
from harness.report.lab.trust_content import TrustReport
from harness.report.lab.trust_tables import (
    captures_table,
    distances_table,
    equivalence_table,
    health_table,
    pairs_table,
)
from harness.report.lab.trust_wording import (
    EXPLORATORY,
    correlation_text,
    metric_title,
    simulated_with,
    verdict_sentence,
)
from harness.results.trust_findings import TrustFindings

_WIDTH = 118


def format_trust(report: TrustReport) -> str:
    """The text of a trust study; parts without content are left out."""
    found = report.findings
    lines = [EXPLORATORY] if found.exploratory else []
    lines += [verdict_sentence(found), *([found.why] if found.why else [])]
    lines += ["", *_head(found)]
    for title, table, shrinkable in (
        (f"pairs in {metric_title(found.ranked_metric)}", pairs_table(found), (0, 8)),
        ("simulation minus device", equivalence_table(found), (0, 1)),
        ("distance of the errors", distances_table(found), (6,)),
        ("stream health", health_table(found), ()),
        ("captures", captures_table(found), (0,)),
    ):
        lines += _part(title, table, shrinkable)
    if found.rank_correlations:
        lines += ["", *(correlation_text(one) for one in found.rank_correlations)]
    lines += [f"damage: {capture.file}: {text}" for capture in found.captures for text in capture.damage]
    lines += [f"failed: {cell}: {last_line(why)}" for cell, why in found.failures.items()]
    return "\n".join([*lines, *(f"note: {text}" for text in found.notes)])


def _head(found: TrustFindings) -> list[str]:
    """Plan, simulation and captures."""
    counts = ((len(found.captures), "capture"), (len(found.arms), "arm"), (len(found.seeds), "seed"))
    return [
        f"{found.title}: plan {found.plan_digest[:12]}, scenario {found.scenario}",
        f"simulated with {simulated_with(found)}",
        f"{', '.join(count_noun(count, noun) for count, noun in counts)}, level {found.level:g}",
    ]


def _part(title: str, table: Table, shrinkable: tuple[int, ...]) -> list[str]:
    """A title and a table; nothing without rows."""
    if not table.rows:
        return []
    return ["", title, *(line for row in table.wrapped_rows(_WIDTH, shrinkable) for line in row)]
