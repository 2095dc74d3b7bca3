"""The table of claims on a paper's page: each published statement next to the measured result."""

from collections.abc import Sequence

from harness.report.kit.markup import Markup, inline_code, join, tag
from harness.report.kit.statement_lines import MARKS, format_difference, format_interval, format_kind, format_p
from harness.report.kit.table import stacked_cell
from harness.report.kit.text import to_file_name
from harness.report.kit.verdict_badge import verdict_badge
from harness.results.benchmark_statement import BenchmarkStatement
from harness.results.findings import PaperExperiment, PaperFindings

_HEAD = ("claim", "kind", "published", "measured", "difference", "units", "verdict")


def claims_table(findings: PaperFindings) -> Markup:
    """All claims in one table, a group of rows for each experiment."""
    groups = []
    for experiment in findings.experiments:
        if experiment.claims:
            link = tag("a", experiment.title, href=f"#{anchor(experiment)}")
            title = tag("th", link, scope="rowgroup", colspan=len(_HEAD), role="rowheader")
            rows = [_claim(claim) for claim in experiment.claims]
            groups.append(tag("tbody", tag("tr", title, class_="group", role="row"), *rows, role="rowgroup"))
    return _table(groups) if groups else Markup()


def claims_list(claims: Sequence[BenchmarkStatement]) -> Markup:
    """The table of claims that belong to no experiment; nothing without claims."""
    rows = [_claim(claim) for claim in claims]
    return _table([tag("tbody", *rows, role="rowgroup")]) if rows else Markup()


def _table(groups: Sequence[Markup]) -> Markup:
    top = tag("tr", *(tag("th", text, scope="col", role="columnheader") for text in _HEAD), role="row")
    text = (
        "Difference: mean of the paired differences over units (performers, or clips where a note says so) and its "
        "95 % interval; positive values agree with the paper. p: by sign flips (by Welch's test where units do not "
        "pair), after Holm's correction for all printed "
        "statements of the paper with the same version of the methods (as printed, ours). The text under a claim gives "
        "the reason for its verdict. Kind: the paper prints a printed statement; a derived one follows from those or "
        "is our interpretation of a word; a repeated one asks one more method; speed compares today's machines with "
        "the paper's. Only printed statements count in the headline."
    )
    content = tag(
        "table", tag("thead", top, role="rowgroup"), *groups, class_="claims", role="table", aria_label="claims"
    )
    return join(tag("p", text, class_="caption"), content)


def _claim(claim: BenchmarkStatement) -> Markup:
    why = tag("small", inline_code(claim.why)) if claim.why else None
    p = format_p(claim)
    lower = ", ".join(filter(None, (format_interval(claim), f"p {p}" if p else "")))
    difference = stacked_cell(format_difference(claim), lower)
    badge = verdict_badge(claim.verdict, MARKS[claim.verdict])
    cells = [format_kind(claim), claim.target, claim.measured, difference, claim.clips or "", badge]
    titled = [
        tag("td", cell, data_label=name, role="cell", class_=None if cell else "empty")
        for name, cell in zip(_HEAD[1:], cells, strict=True)
    ]
    return tag("tr", tag("th", claim.text, why, scope="row", role="rowheader"), *titled, role="row")


def anchor(experiment: PaperExperiment) -> str:
    """The anchor of the experiment's section."""
    return f"experiment-{to_file_name(experiment.name)}"
