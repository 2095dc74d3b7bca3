"""The truth table of the page: what each row is held to, what was measured, and whether it is met."""

from collections.abc import Sequence

from harness.core.number_format import NOT_MEASURED, count_noun
from harness.report.kit.page import Badge, DataTable, Stack
from harness.report.kit.statement_lines import MARKS
from harness.report.kit.text import list_first
from harness.results.benchmark_statement import BenchmarkStatement

_HEAD = ("condition", "held to", "measured", "verdict", "published")
_CAPTION = (
    "Held to: the range that the simulated errors should lie in. Measured: the figure of this run. Published: the "
    "figure that the range comes from. A row outside its range is missed."
)


def result_sentence(model: str, rows: Sequence[BenchmarkStatement]) -> str:
    """How many rows a model meets, and which it misses, in one sentence."""
    if not rows:
        return f"The errors of {model} were not held to any published figure."
    missed = [row.text for row in rows if row.verdict == "missed"]
    verdicts = [row.verdict for row in rows]
    without = len(rows) - verdicts.count("met") - len(missed)
    parts = [f"meets {verdicts.count('met')}"]
    if missed:
        parts.append(f"misses {len(missed)} ({list_first(missed, separator='; ')})")
    if without:
        parts.append(f"has no verdict on {without}")
    *start, last = parts
    counted = f"{', '.join(start)} and {last}" if start else last
    return f"Of {count_noun(len(rows), 'row')} of the truth table, {model} {counted}."


def truth_table(rows: Sequence[BenchmarkStatement]) -> DataTable:
    """The table of the page: how a figure was measured stands below it."""
    cells = [
        [
            row.text,
            row.target,
            Stack(row.measured or NOT_MEASURED, row.why),
            Badge(row.verdict or "no verdict", MARKS[row.verdict] or "–"),
            row.reference or "–",
        ]
        for row in rows
    ]
    return DataTable(_HEAD, cells, caption=_CAPTION, label="truth table", cards=True)
