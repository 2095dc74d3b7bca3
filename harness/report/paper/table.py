"""HTML of a paper's tables: text cells wrap and are aligned left, numbers are aligned right."""

import re
from collections.abc import Sequence
from typing import Any

from harness.core.number_format import NOT_MEASURED
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, inline_code, tag
from harness.report.kit.table import NOT_MEASURED_CELL, html_table
from harness.results.findings import FindingsTable

_NUMBER = re.compile(r"[−+-]?[\d.,]+\b.{,24}|[–—-]?|not measured")
"""Texts that are aligned right, as numbers are."""
_LETTER_EM, _FIRST_EM, _WIDE_EM, _WIDEST_EM, _LONG_CELL_LETTERS = 0.55, 13.0, 22.0, 44.0, 300
"""Width of an average letter; greatest widths of the first column, of others, and of those with a cell of more
letters than the last number."""


def paper_table(content: FindingsTable) -> Markup:
    """The table, or one sentence if it has no rows."""
    if not content.rows:
        return tag("p", tag("b", content.title), ": nothing was measured.", class_="caption")
    first, *columns = zip(content.columns, *content.rows, strict=True)
    cells = [_text_cells(first, _FIRST_EM), *map(_column_cells, columns)]
    head, *rows = map(list, zip(*cells, strict=True))
    return html_table(Table(head, rows), tag("b", content.title), label=content.title)


def _column_cells(cells: Sequence[str]) -> list[Any]:
    """The cells of one column, its title first."""
    if all(_NUMBER.fullmatch(cell) for cell in cells[1:]):
        return [cells[0], *map(_number_cell, cells[1:])]
    return _text_cells(cells, _WIDEST_EM if max(map(len, cells)) > _LONG_CELL_LETTERS else _WIDE_EM)


def _text_cells(cells: Sequence[str], widest_em: float) -> list[Any]:
    width = f"width: {min(_LETTER_EM * max(map(len, cells)) + 1.0, widest_em):.0f}em"
    return [tag("span", inline_code(cell), class_="words", style=width) for cell in cells]


def _number_cell(text: str) -> Any:
    return NOT_MEASURED_CELL if text == NOT_MEASURED else text
