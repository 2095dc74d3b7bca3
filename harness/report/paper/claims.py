"""The verdicts of a paper's page: how many there are of each, and every claim beside ours."""

from collections.abc import Sequence

from harness.report.kit.markup import Markup, join, tag
from harness.report.paper.table import inline_code
from harness.report.paper.verdicts import MARKS, MEANINGS, count_verdicts, format_difference, format_interval
from harness.report.run.data import to_file_name
from harness.results.findings import Claim, ClaimVerdict, PaperExperiment, PaperFindings

_HEAD = ("published statement", "published", "ours", "difference", "clips", "verdict")


def tally_list(found: list[Claim]) -> Markup:
    """A number for each verdict, and what the verdict means."""
    items = []
    for kind, count in count_verdicts(found).items():
        items.append(tag("li", tag("b", count), _verdict(kind), tag("span", MEANINGS[kind], class_="meaning")))
    return tag("ul", *items, class_="tally")


def _verdict(kind: ClaimVerdict) -> Markup:
    mark = tag("span", MARKS[kind], aria_hidden="true", class_="mark")
    return tag("span", mark, kind, class_=f"verdict {to_file_name(kind)}")


def claims_table(findings: PaperFindings) -> Markup:
    """One table, a group of rows for each experiment."""
    groups = []
    for experiment in findings.experiments:
        if experiment.claims:
            link = tag("a", experiment.title, href=f"#{anchor(experiment)}")
            title = tag("th", link, scope="rowgroup", colspan=len(_HEAD), role="rowheader")
            rows = [_claim(claim) for claim in experiment.claims]
            groups.append(tag("tbody", tag("tr", title, class_="group", role="row"), *rows, role="rowgroup"))
    return _table(groups) if groups else Markup()


def claims_list(found: Sequence[Claim]) -> Markup:
    """The same table of a few claims that belong to no experiment."""
    rows = [_claim(claim) for claim in found]
    return _table([tag("tbody", *rows, role="rowgroup")]) if rows else Markup()


def _table(groups: Sequence[Markup]) -> Markup:
    top = tag("tr", *(tag("th", text, scope="col", role="columnheader") for text in _HEAD), role="row")
    text = (
        "Difference: the mean of paired differences over clips and its 95 % interval, positive on the published side. "
        "Under a statement: why its verdict is what it is."
    )
    whole = tag(
        "table", tag("thead", top, role="rowgroup"), *groups, class_="claims", role="table", aria_label="claims"
    )
    return join(tag("p", text, class_="caption"), whole)


def _claim(claim: Claim) -> Markup:
    why = tag("small", inline_code(claim.why)) if claim.why else None
    within = format_interval(claim)
    distance = join(format_difference(claim), tag("span", within, class_="spread under") if within else None)
    cells = [claim.published, claim.ours, distance, claim.clips or "", _verdict(claim.verdict)]
    named = [
        tag("td", cell, data_label=name, role="cell", class_=None if cell else "empty")
        for name, cell in zip(_HEAD[1:], cells, strict=True)
    ]
    return tag("tr", tag("th", claim.text, why, scope="row", role="rowheader"), *named, role="row")


def anchor(experiment: PaperExperiment) -> str:
    """What links to its section name."""
    return f"experiment-{to_file_name(experiment.name)}"
