"""Statements with their verdicts as one text table, for benchmarks, truth tables and papers."""

import textwrap
from collections.abc import Mapping, Sequence

from harness.core.number_format import decimals_for, format_number
from harness.core.text_table import Table
from harness.results.benchmark_statement import BenchmarkStatement, Verdict

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
_HEAD = ("statement", "kind", "target", "measured", "difference", "95 % interval", "p (Holm)", "units", "verdict")
_SHRINKABLE = (0, 2, 3, 9)
"""Columns that wrap where lines would be too long."""
_INDENT = "  "


def statement_lines(
    statements: Sequence[BenchmarkStatement],
    *,
    target: str = "target",
    reference: str = "reference, in the same run",
    width: int = WIDTH,
) -> list[str]:
    """A table with a row for each statement, and under the row the reason for its verdict; columns in use only.

    `target` and `reference` are the heads of their columns. Lines have at most `width` characters where words allow it.
    """
    rows = [[_one_line(cell) for cell in _cells(statement)] for statement in statements]
    head = [target if name == "target" else name for name in (*_HEAD, reference)]
    used = [i for i in range(len(head)) if i == 0 or any(row[i] for row in rows)]
    table = Table([head[i] for i in used], [[row[i] for i in used] for row in rows], text_columns=len(used))
    shrinkable = [n for n, i in enumerate(used) if i in _SHRINKABLE]
    lines, *wrapped_rows = table.wrapped_rows(width, shrinkable)
    for row_lines, statement in zip(wrapped_rows, statements, strict=True):
        lines += row_lines
        lines += wrap_lines(f"why: {statement.why}", width, 2 * _INDENT) if statement.why else []
    return lines


def _cells(statement: BenchmarkStatement) -> tuple[str, ...]:
    return (
        statement.text,
        format_kind(statement),
        statement.target,
        statement.measured,
        format_difference(statement),
        format_interval(statement),
        format_p(statement),
        str(statement.clips) if statement.clips else "",
        statement.verdict,
        statement.reference,
    )


def wrap_lines(text: str, width: int, indent: str = "") -> list[str]:
    """The text in lines of at most `width` characters; lines after the first are indented more."""
    return textwrap.wrap(_one_line(text), width, initial_indent=indent, subsequent_indent=indent + _INDENT) or [""]


def _one_line(text: str) -> str:
    """The text with every run of white space replaced by one blank."""
    return " ".join(text.split())


def format_kind(statement: BenchmarkStatement) -> str:
    """Kind and reading of a statement, such as "printed, ours"."""
    return ", ".join(filter(None, (statement.kind, statement.reading)))


def format_difference(statement: BenchmarkStatement) -> str:
    """The mean difference with its unit; "" where there is none or `measured` already shows the same number."""
    if statement.value is None:
        return ""
    text = f"{_format_number(statement.value, statement)} {statement.unit}".rstrip()
    is_shown = not statement.kind or f" {text}" in f" {statement.measured}"
    return "" if statement.low is None and is_shown else text


def format_interval(statement: BenchmarkStatement) -> str:
    """The interval, "−0.20 to 0.31"; "" where it was not computed."""
    if statement.low is None or statement.high is None:
        return ""
    return f"{_format_number(statement.low, statement)} to {_format_number(statement.high, statement)}"


def format_p(statement: BenchmarkStatement) -> str:
    """The p of a printed statement after Holm's correction, such as "0.012"; "" where there is none."""
    if statement.p_holm is None:
        return ""
    return "< 0.001" if statement.p_holm < 0.001 else f"{statement.p_holm:.3f}"


def _format_number(value: float, statement: BenchmarkStatement) -> str:
    """A number with the decimals that the smallest of difference and ends needs not to read 0.00."""
    return format_number(value, statement.unit, decimals=decimals_for(statement.value, statement.low, statement.high))
