"""Statements with their verdicts as one table, for benchmarks, truth tables and papers."""

from collections.abc import Mapping, Sequence

from harness.core.number_format import Interval, format_number, format_p_value
from harness.report.kit.page import Badge, DataTable, Stack
from harness.report.kit.page_text import table_lines
from harness.results.findings import BenchmarkStatement, Verdict

WIDTH = 160
"""Most characters of a line."""
MARKS: Mapping[Verdict, str] = {
    "reproduced": "✓",
    "same": "=",
    "not reproduced": "✗",
    "cannot tell": "?",
    "not comparable": "≠",
    "not run": "–",
    "met": "✓",
    "missed": "✗",
    "no verdict": "–",
    "": "",
}


def statement_head(first: str = "statement", target: str = "target", reference: str = "reference") -> list[str]:
    """Heads of the columns of `statement_row`."""
    return [first, "kind", target, "measured", "difference", "units", "verdict", reference]


def statement_row(statement: BenchmarkStatement) -> list[object]:
    """The cells of a statement, with the reason for its verdict below the text."""
    return [
        Stack(statement.text, statement.why),
        ", ".join(filter(None, (statement.kind, statement.reading))),
        statement.target,
        statement.measured,
        _difference(statement),
        statement.clips or "",
        Badge(statement.verdict, MARKS[statement.verdict]) if statement.verdict else "",
        statement.reference,
    ]


def format_statements(
    statements: Sequence[BenchmarkStatement], *, reference: str = "reference, in the same run"
) -> list[str]:
    """The table in lines; `reference` is the head of its last column."""
    rows = [statement_row(statement) for statement in statements]
    return table_lines(DataTable(statement_head(reference=reference), rows), WIDTH) if rows else []


def _difference(statement: BenchmarkStatement) -> object:
    """The mean difference with its interval and p; "" where there is none or `measured` already shows it."""
    if statement.value is None:
        return ""
    text = f"{format_number(statement.value, statement.unit)} {statement.unit}".rstrip()
    if statement.low is None and (not statement.kind or f" {text}" in f" {statement.measured}"):
        return ""
    number = Interval.of(statement.value, statement.low, statement.high, statement.unit)
    return number if statement.p_holm is None else Stack(number, f"p {format_p_value(statement.p_holm)}")
