"""The terminal's rendering of a page: headline, facts, then each section as lines of text."""

import re
import textwrap
from collections.abc import Sequence

from harness.core.number_format import Interval
from harness.core.text_table import Table
from harness.report.kit.page import Block, Bullets, DataTable, Drawing, Page, Prose, TerminalOnly

WIDTH = 118
"""Most characters of a line, unless a word or a number is longer."""
NUMBER = re.compile(r"(< |± )?[−+-]?[\d.,]+\b.{,28}|[–—-]?|exact|known|none|yes|no|no fix|not measured")
"""Texts that are aligned right, as numbers are."""


def render_text(page: Page, width: int = WIDTH) -> str:
    """The text of a page; what a terminal cannot show, and explanations of columns, are left out."""
    lines = _wrapped(page.headline, width) + join_blocks(page.lead, width, after_text=True)
    facts = [
        f"{_uncapitalised(title)}: {text}"
        for title, text in page.facts.items()
        if text and (page.printed_facts is None or title in page.printed_facts)
    ]
    lines += ["", *(line for fact in facts for line in _wrapped(fact, width, "  "))] if facts else []
    for section in page.sections:
        if section.terminal and (content := join_blocks(section.blocks, width)):
            lines += ["", *_wrapped(section.heading or _uncapitalised(section.title), width), *content]
    return "\n".join(lines)


def join_blocks(blocks: Sequence[Block], width: int, *, after_text: bool = False) -> list[str]:
    """The lines of several blocks; a table stands apart from what is above it."""
    lines: list[str] = []
    for block in blocks:
        content = block_lines(block, width)
        is_apart = isinstance(block, DataTable | Drawing | TerminalOnly) and (lines or after_text)
        lines += ["", *content] if content and is_apart else content
    return lines


def block_lines(block: Block, width: int = WIDTH) -> list[str]:
    """The lines of one block; none for what only a browser shows."""
    match block:
        case Prose():
            return _wrapped(block.text, width)
        case Bullets():
            return [line for item in block.items for line in _wrapped(f"{block.prefix}{item}", width, "  ")]
        case DataTable() if block.rows:
            return table_lines(block, width)
        case Drawing():
            return join_blocks(block.tables, width)
        case TerminalOnly():
            return join_blocks(block.blocks, width)
        case _:
            return []


def table_lines(table: DataTable, width: int = WIDTH) -> list[str]:
    """The lines of a table: columns without anything are left out, words wrap and are aligned left."""
    shown = table.rows[: table.most_printed]
    rows = [[_text(cell, table.intervals_printed) for cell in row] for row in shown if len(row) > 1]
    used = [n for n in range(len(table.head)) if n == 0 or any(row[n] for row in rows)]
    words = [n for n, at in enumerate(used) if at == 0 or not all(NUMBER.fullmatch(row[at]) for row in rows)]
    content = Table([table.head[n] for n in used], [[row[n] for n in used] for row in rows], text_columns=words)
    head, *wrapped = content.wrapped_rows(width, words)
    title = f"{_uncapitalised(table.title)} {table.caption}" if table.caption_printed else table.title
    lines, rest = [*_wrapped(title, width), *head], iter(wrapped)
    for row in shown:
        lines += next(rest) if len(row) > 1 else ["", str(row[0])]
    more = len(table.rows) - len(shown) + table.omitted
    return [*lines, *([f"and {more:,} more"] if more else [])]


def _uncapitalised(title: str) -> str:
    return title if title[1:2] in ("", " ") else title[0].lower() + title[1:]


def _text(cell: object, with_interval: bool) -> str:
    text = cell.number if isinstance(cell, Interval) and not with_interval else str(cell)
    return " ".join(text.split())


def _wrapped(text: str, width: int, indent: str = "") -> list[str]:
    return textwrap.wrap(" ".join(text.split()), width, subsequent_indent=indent)
