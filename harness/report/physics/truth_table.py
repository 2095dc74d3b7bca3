"""The truth table: what each row is held to, what was measured, and whether it is met, for the page and as text."""

from collections.abc import Sequence

from harness.core.number_format import NOT_MEASURED, count_noun
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, join, scroll_box, tag
from harness.report.kit.table import NOT_MEASURED_CELL, stacked_cell
from harness.report.kit.text import list_first
from harness.report.kit.verdict_badge import verdict_badge
from harness.report.physics.error_comparison import TruthRow

_WORDS = {True: "met", False: "missed", None: "no verdict"}
_MARKS = {True: "✓", False: "✗", None: "–"}
_HEAD = ("condition", "held to", "measured", "verdict", "published")
_CAPTION = (
    "Held to: the range that the simulated errors should lie in. Measured: the figure of this run. Published: the "
    "figure that the range comes from. A row outside its range is missed."
)
_TEXT_WIDTH, _SHRINKABLE = 118, (0, 1, 2, 4, 5)


def result_sentence(model: str, rows: Sequence[TruthRow]) -> str:
    """How many rows a model meets, and which it misses, in one sentence."""
    if not rows:
        return f"The errors of {model} were not held to any published figure."
    missed = [row.name for row in rows if row.met is False]
    without = sum(row.met is None for row in rows)
    parts = [f"meets {sum(row.met is True for row in rows)}"]
    if missed:
        parts.append(f"misses {len(missed)} ({list_first(missed, separator='; ')})")
    if without:
        parts.append(f"has no verdict on {without}")
    *start, last = parts
    verdicts = f"{', '.join(start)} and {last}" if start else last
    return f"Of {count_noun(len(rows), 'row')} of the truth table, {model} {verdicts}."


def truth_table(rows: Sequence[TruthRow]) -> Markup | None:
    """The table of the page; None without rows."""
    if not rows:
        return None
    head = tag("tr", *(tag("th", text, scope="col", role="columnheader") for text in _HEAD), role="row")
    body = [
        tag(
            "tr",
            tag("th", row.name, scope="row", role="rowheader"),
            _cell("held to", row.held_to),
            _cell("measured", tag("span", stacked_cell(row.measured or NOT_MEASURED_CELL, row.note))),
            _cell("verdict", verdict_badge(_WORDS[row.met], _MARKS[row.met])),
            _cell("published", row.published or "–"),
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


def truth_lines(rows: Sequence[TruthRow]) -> list[str]:
    """The table as lines of text, at most 118 characters wide where the words allow."""
    cells = [
        [row.name, row.held_to, row.measured or NOT_MEASURED, _WORDS[row.met], row.published or "–", row.note]
        for row in rows
    ]
    table = Table([*_HEAD, "note"], cells, text_columns=len(_HEAD) + 1)
    return [line for wrapped in table.wrapped_rows(_TEXT_WIDTH, _SHRINKABLE) for line in wrapped]


def _cell(label: str, content: object) -> Markup:
    return tag("td", content, data_label=label, role="cell")
