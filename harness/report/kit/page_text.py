"""The terminal's rendering of a page: headline, facts, then each section as lines of text."""

import re
import textwrap

from harness.core.interval import Interval
from harness.core.text_table import Table
from harness.report.kit.page import Block, Bullets, DataTable, Drawing, Page, Prose

WIDTH = 118
"""Most characters of a line, unless a word or a number is longer."""
NUMBER = re.compile(r"(< |± )?[−+-]?[\d.,]+\b.{,28}|[–—-]?|exact|yes|no|not measured")
"""Texts that are aligned right, as numbers are."""


def page_text(page: Page, width: int = WIDTH) -> str:
    """The text of a page; what a terminal cannot show, and explanations of columns, are left out."""
    lines = _wrapped(page.headline, width)
    for block in page.lead:
        lines += block_lines(block, width)
    facts = [
        f"{title.lower()}: {text}"
        for title, text in page.facts.items()
        if text and (page.printed_facts is None or title in page.printed_facts)
    ]
    lines += ["", *(line for fact in facts for line in _wrapped(fact, width, "  "))] if facts else []
    for section in page.sections:
        if section.terminal and (content := [line for b in section.blocks for line in block_lines(b, width)]):
            lines += ["", section.heading or section.title.lower(), *content]
    return "\n".join(lines)


def block_lines(block: Block, width: int = WIDTH) -> list[str]:
    """The lines of one block; none for what only a browser shows."""
    match block:
        case Prose() if block.terminal:
            return _wrapped(block.text, width)
        case Bullets():
            return [line for item in block.items for line in _wrapped(f"{block.prefix}{item}", width, "  ")]
        case DataTable() if block.rows:
            return table_lines(block, width)
        case Drawing():
            return [line for table in block.tables for line in block_lines(table, width)]
        case _:
            return []


def table_lines(table: DataTable, width: int = WIDTH) -> list[str]:
    """The lines of a table: columns without anything are left out, words wrap and are aligned left."""
    rows = [[_text(cell, table.intervals_printed) for cell in row] for row in table.rows[: table.most_printed]]
    used = [n for n, head in enumerate(table.head) if n == 0 or any(row[n] for row in rows)]
    rows = [[row[n] for n in used] for row in rows]
    words = [n for n in range(len(used)) if n == 0 or not all(NUMBER.fullmatch(row[n]) for row in rows)]
    content = Table([table.head[n] for n in used], rows, text_columns=words)
    lines = [line for row in content.wrapped_rows(width, words) for line in row]
    more = len(table.rows) - len(rows)
    return [*([table.title] if table.title else []), *lines, *([f"and {more:,} more"] if more else [])]


def _text(cell: object, with_interval: bool) -> str:
    return cell.number if isinstance(cell, Interval) and not with_interval else str(cell)


def _wrapped(text: str, width: int, indent: str = "") -> list[str]:
    return textwrap.wrap(" ".join(text.split()), width, subsequent_indent=indent, break_long_words=False)
