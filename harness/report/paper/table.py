"""Tables of texts and numbers: words on the left of their columns and in several lines, numbers on the right."""

import re
from collections.abc import Sequence
from typing import Any

from harness.report.kit.markup import Markup, join, table, tag
from harness.report.paper.figure_table import NOT_MEASURED
from harness.results.findings import FindingsTable

_NUMBER = re.compile(r"[−+-]?[\d.,]+\b.{,24}|[–—-]?|not measured")
"""What stands on the right of its column."""
_CODE = re.compile(r"`([^`]+)`")
_LETTER_EM, _FIRST_EM, _WIDE_EM, _WIDEST_EM, _LONG_CELL_LETTERS = 0.55, 13.0, 22.0, 44.0, 300
"""An average letter; the widths from which the first column, others, and those with longer cells break their lines."""


def paper_table(content: FindingsTable) -> Markup:
    """As wide as its words need; one sentence where there is no row."""
    if not content.rows:
        return tag("p", tag("b", content.title), ": nothing was measured.", class_="caption")
    first, *columns = zip(content.columns, *content.rows, strict=True)
    cells = [_text_cells(first, _FIRST_EM), *map(_column_cells, columns)]
    head, *rows = map(list, zip(*cells, strict=True))
    return table(tag("b", content.title), head, rows, label=content.title)


def _column_cells(cells: Sequence[str]) -> list[Any]:
    """A title and what stands under it."""
    if all(_NUMBER.fullmatch(cell) for cell in cells[1:]):
        return [cells[0], *map(_number_cell, cells[1:])]
    return _text_cells(cells, _WIDEST_EM if max(map(len, cells)) > _LONG_CELL_LETTERS else _WIDE_EM)


def _text_cells(cells: Sequence[str], widest_em: float) -> list[Any]:
    width = f"width: {min(_LETTER_EM * max(map(len, cells)) + 1.0, widest_em):.0f}em"
    return [tag("span", inline_code(cell), class_="words", style=width) for cell in cells]


def inline_code(text: str) -> Markup:
    """With what stands between backticks as code."""
    return join(*(tag("code", part) if n % 2 else part for n, part in enumerate(_CODE.split(text))))


def _number_cell(text: str) -> Any:
    return tag("span", text, class_="none") if text == NOT_MEASURED else text
