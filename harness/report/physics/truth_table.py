"""The truth table: what each row is held to, what was measured, and whether it is met, for the page and as text."""

from collections.abc import Sequence

from harness.core.number_format import NOT_MEASURED, count_noun
from harness.report.kit.page import Badge, DataTable, Stack
from harness.report.kit.page_text import table_lines
from harness.report.kit.text import list_first
from harness.report.physics.error_comparison import TruthRow

_WORDS = {True: "met", False: "missed", None: "no verdict"}
_MARKS = {True: "✓", False: "✗", None: "–"}
_HEAD = ("condition", "held to", "measured", "verdict", "published")
_CAPTION = (
    "Held to: the range that the simulated errors should lie in. Measured: the figure of this run. Published: the "
    "figure that the range comes from. A row outside its range is missed."
)


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


def truth_table(rows: Sequence[TruthRow]) -> DataTable:
    """The table of a page: the note of a row stands below the figure that was measured."""
    cells = [
        [
            row.name,
            row.held_to,
            Stack(row.measured or NOT_MEASURED, row.note),
            Badge(_WORDS[row.met], _MARKS[row.met]),
            row.published or "–",
        ]
        for row in rows
    ]
    return DataTable(_HEAD, cells, caption=_CAPTION, label="truth table", cards=True)


def truth_lines(rows: Sequence[TruthRow]) -> list[str]:
    """The table as lines of text."""
    return table_lines(truth_table(rows)) if rows else []
