"""Printed statements of a paper with two results each: of the methods as printed, and of ours."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from harness.core.text_table import Table
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.statement_lines import MARKS
from harness.report.kit.table import stacked_cell
from harness.report.kit.verdict_badge import verdict_badge
from harness.report.paper.verdicts import READINGS
from harness.results.benchmark_statement import BenchmarkStatement, Reading
from harness.results.findings import PaperFindings

_VARIANT = re.compile(r":(literal|chai2005)\b")
"""Names of methods as printed, which the statement leaves out."""


@dataclass(frozen=True)
class PrintedStatement:
    """A statement that the paper prints."""

    text: str
    """The statement, with the names of the paper's methods."""
    published: str
    claims: Mapping[Reading, BenchmarkStatement]
    """Reading -> the claim; a claim of no method stands for both."""


def printed_statements(findings: PaperFindings) -> list[PrintedStatement]:
    """All printed statements in the order of the experiments, each once."""
    found: dict[tuple[str, str], dict[Reading, BenchmarkStatement]] = {}
    for experiment in findings.experiments:
        for claim in experiment.claims:
            if claim.kind == "printed":
                readings: tuple[Reading, ...] = (claim.reading,) if claim.reading else tuple(READINGS)
                row = found.setdefault((_VARIANT.sub("", claim.text), claim.target), {})
                row |= dict.fromkeys(readings, claim)
    return [PrintedStatement(text, published, claims) for (text, published), claims in found.items()]


def statements_table(statements: Sequence[PrintedStatement]) -> Markup:
    """The table of a page: statement, published value, and the result of each reading with its verdict."""
    head = ("statement", "published", *READINGS)
    top = tag("tr", *(tag("th", text, scope="col", role="columnheader") for text in head), role="row")
    rows = [
        tag(
            "tr",
            tag("th", statement.text, scope="row", role="rowheader"),
            tag("td", statement.published, data_label="published", role="cell"),
            *(_cell(statement.claims.get(reading), reading) for reading in READINGS),
            role="row",
        )
        for statement in statements
    ]
    text = (
        "As printed: the equations of the paper, without additions. Ours: the methods of this project that extend "
        "them. Errors are means over units. The headline counts these verdicts. The next table adds differences, "
        "intervals and reasons."
    )
    table = tag(
        "table",
        tag("thead", top, role="rowgroup"),
        tag("tbody", *rows, role="rowgroup"),
        class_="claims statements",
        role="table",
        aria_label="printed statements",
    )
    return join(tag("p", text, class_="caption"), table)


def _cell(claim: BenchmarkStatement | None, reading: Reading) -> Markup:
    if claim is None:
        return tag("td", "", data_label=reading, role="cell", class_="empty")
    badge = verdict_badge(claim.verdict, MARKS[claim.verdict])
    return tag("td", stacked_cell(badge, claim.measured), data_label=reading, role="cell")


def statements_lines(statements: Sequence[PrintedStatement], width: int) -> list[str]:
    """The table of `statements_table` as text, in lines of at most `width` characters."""
    head = ["statement", "published", *(name for reading in READINGS for name in (reading, "verdict"))]
    rows = []
    for statement in statements:
        row = [statement.text, statement.published]
        for reading in READINGS:
            claim = statement.claims.get(reading)
            row += [claim.measured, claim.verdict] if claim else ["", ""]
        rows.append(row)
    table = Table(head, rows, text_columns=len(head))
    lines, *wrapped = table.wrapped_rows(width, [0, 2, 4])
    return [*lines, *(line for row_lines in wrapped for line in row_lines)]
