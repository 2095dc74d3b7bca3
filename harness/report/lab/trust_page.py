"""The page of a trust study: the verdict, the pairs of methods, then what the simulation gets right and wrong."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from harness.core.files import write_text
from harness.core.number_format import count_noun
from harness.core.text_table import Table
from harness.report.kit.document import Section, chart_figure, document
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.style import Chart
from harness.report.kit.table import html_table, stacked_cell
from harness.report.kit.text import last_line, list_first, to_file_name
from harness.report.kit.verdict_badge import tally_list, verdict_badge
from harness.report.lab.stacked_intervals import stack_intervals
from harness.report.lab.trust_charts import charts
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
    OUTCOME_TITLES,
    PAIR_MARKS,
    PAIR_MEANINGS,
    clips,
    correlation_text,
    count_pairs,
    metric_title,
    simulated_with,
    sort_pairs,
    verdict_sentence,
)
from harness.results.trust_findings import TrustFindings

_DISTANCES = (
    "Do the errors of the tracker look alike? The energy distance is zero only where two distributions are equal. "
    "Blocks of at least five correlation times are permuted. The distance between random halves of the device's own "
    "captures is the yardstick."
)
_HEALTH = "What the stream of each station is like on both sides: how often it is lost, for how long, at what quality."
_EQUIVALENCE = (
    "Two one-sided tests for each metric of each method. The margins stand in the plan, which was fixed before the "
    "captures."
)


def write_trust_page(path: Path, report: TrustReport) -> Path:
    """Write the page to `path` and return it; its folder is created. Without matplotlib it has only tables."""
    drawable = find_spec("matplotlib") is not None
    missing = [] if drawable else ["Charts: matplotlib is not installed (extra viz); tables show their numbers"]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, trust_page(report, charts(report.findings) if drawable else {}, missing))
    return path


def trust_page(report: TrustReport, drawn: Mapping[str, Chart], missing: Sequence[str]) -> str:
    """The HTML of the page with the charts of `trust_charts.charts`; without its chart a section has its table open."""
    found = report.findings
    word = tag("span", OUTCOME_TITLES[found.outcome], class_=f"big {to_file_name(found.outcome.word)}")
    sections: list[Section] = [
        ("Pairs", "pairs", _pairs(found, drawn)),
        ("Ranks", "ranks", _ranks(found, drawn)),
        ("Margins", "equivalence", _section(drawn, "equivalence", _EQUIVALENCE, equivalence_table(found))),
        ("Distance of the errors", "distances", _section(drawn, "distances", _DISTANCES, distances_table(found))),
        ("Stream health", "health", _section(drawn, "health", _HEALTH, health_table(found))),
        ("Captures", "captures", _captures(found)),
        ("Made by", "command", tag("pre", tag("code", report.command))),
    ]
    return document(
        title=f"{found.title}: harness trust",
        kicker=f"harness trust · {found.title}",
        heading=join(word, verdict_sentence(found)),
        facts=_facts(found),
        missing=missing,
        sections=sections,
        lead=_lead(found),
    )


def _lead(found: TrustFindings) -> Markup:
    why = tag("p", f"{found.why[0].upper()}{found.why[1:]}") if found.why else None
    exploratory = tag("p", EXPLORATORY, class_="missing") if found.exploratory else None
    return join(
        exploratory, why, tally_list(count_pairs(found.pairs), PAIR_MARKS, PAIR_MEANINGS) if found.pairs else None
    )


def _facts(found: TrustFindings) -> dict[str, str]:
    names = clips(found)
    facts = {
        "Methods": list_first(found.arms, 8),
        "Motion": f"{count_noun(len(names), 'clip')}: {list_first(names, 4)}" if names else "none",
        "Simulated with": simulated_with(found),
        "Scenario": found.scenario,
        "Ranked by": metric_title(found.ranked_metric),
        "Plan": f"digest {found.plan_digest[:12]}",
        "Level": f"{found.level:g}; simulated errors of {count_noun(len(found.seeds), 'seed')}",
        "Failed": list_first([f"{cell}: {last_line(why)}" for cell, why in found.failures.items()]),
    }
    return {title: text for title, text in facts.items() if text}


def _pairs(found: TrustFindings, drawn: Mapping[str, Chart]) -> Markup:
    if not found.pairs:
        return Markup()
    plain = stack_intervals(pairs_table(found))
    rows = [list(row[:-1]) for row in plain.rows]  # the last column, the reason, stands below the verdict
    for row, pair in zip(rows, sort_pairs(found.pairs), strict=True):
        row[1] = stacked_cell(verdict_badge(pair.verdict, PAIR_MARKS[pair.verdict]), pair.why, "why")
    table = Table(plain.head[:-1], rows)
    caption = (
        f"Error of the first method minus that of the second in {metric_title(found.ranked_metric)}, over units. p is "
        "the larger one of the two sides, after Holm's correction for the number of pairs."
    )
    chart = chart_figure(drawn["pairs"]) if "pairs" in drawn else None
    return join(chart, html_table(table, caption, label="pairs"))


def _ranks(found: TrustFindings, drawn: Mapping[str, Chart]) -> Markup:
    texts = bullet_list([f"{correlation_text(one)}." for one in found.rank_correlations])
    return join(chart_figure(drawn["ranks"]) if "ranks" in drawn else None, texts)


def _section(drawn: Mapping[str, Chart], name: str, caption: str, table: Table) -> Markup:
    """A chart with its numbers folded, or the numbers alone; nothing without rows."""
    if not table.rows:
        return Markup()
    numbers = html_table(table, caption, label=name)
    if name not in drawn:
        return numbers
    return join(chart_figure(drawn[name]), details("Numbers of this chart", numbers))


def _captures(found: TrustFindings) -> Markup:
    damage = [f"{capture.file}: {text}" for capture in found.captures for text in capture.damage]
    failures = [f"{cell}: {last_line(why)}" for cell, why in found.failures.items()]
    table = (
        html_table(captures_table(found), "The captures of the device.", label="captures") if found.captures else None
    )
    return join(table, bullet_list([*damage, *failures, *found.notes]))
