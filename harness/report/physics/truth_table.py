"""The truth table of the page: what each row is held to, what was measured, and whether it is met."""

from collections.abc import Sequence

from harness.core.number_format import count_noun
from harness.report.kit.markup import Markup, join, scroll_box, tag
from harness.report.kit.statement_lines import MARKS
from harness.report.kit.table import NOT_MEASURED_CELL, stacked_cell
from harness.report.kit.text import list_first
from harness.report.kit.verdict_badge import verdict_badge
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


def truth_table(rows: Sequence[BenchmarkStatement]) -> Markup | None:
    """The table of the page; None without rows."""
    if not rows:
        return None
    head = tag("tr", *(tag("th", text, scope="col", role="columnheader") for text in _HEAD), role="row")
    body = [
        tag(
            "tr",
            tag("th", row.text, scope="row", role="rowheader"),
            _cell("held to", row.target),
            _cell("measured", tag("span", stacked_cell(row.measured or NOT_MEASURED_CELL, row.why))),
            _cell("verdict", verdict_badge(row.verdict or "no verdict", MARKS[row.verdict] or "–")),
            _cell("published", row.reference or "–"),
            role="row",
        )
        for row in rows
    ]
    table = tag(
        "table",
        tag("thead", head, role="rowgroup"),
        tag("tbody", *body, role="rowgroup"),
        class_="claims statements",
        role="table",
        aria_label="truth table",
    )
    return join(tag("p", _CAPTION, class_="caption"), scroll_box(table, "truth table"))


def _cell(label: str, content: object) -> Markup:
    return tag("td", content, data_label=label, role="cell")
