"""A table as a record, and its rendering as aligned text."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

_GAP = "  "
_NARROWEST = 12
"""Characters below which a column is not wrapped any further."""


@dataclass(frozen=True)
class Table:
    """A head and rows of equal length; cells are text, or `Markup` in tables that only a page shows."""

    head: Sequence[object]
    rows: Sequence[Sequence[object]]
    text_columns: int | Sequence[int] = 1
    """Columns that are aligned left in text, by number or as many from the left; the others hold numbers."""

    def lines(self) -> list[str]:
        """One line of text for the head and one for each row, columns two blanks apart."""
        return [line for row in self.wrapped_rows() for line in row]

    def wrapped_rows(self, width: int | None = None, shrinkable: Sequence[int] = ()) -> list[list[str]]:
        """The lines of the head, then those of each row.

        With a `width` the `shrinkable` columns are narrowed, the widest first, until a line has at most that many
        characters. Their cells are wrapped. No column becomes narrower than 12 characters, so a line may stay longer.
        """
        cells = [[str(cell) for cell in row] for row in (self.head, *self.rows)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        if width is not None:
            _shrink(widths, width - len(_GAP) * (len(widths) - 1), shrinkable)
        return [self._row_lines(row, widths) for row in cells]

    def _row_lines(self, row: Sequence[str], widths: Sequence[int]) -> list[str]:
        columns, left = [], self.text_columns
        words = range(left) if isinstance(left, int) else left
        for n, (cell, width) in enumerate(zip(row, widths, strict=True)):
            indent = "" if n else _GAP
            fits = len(cell) <= width
            columns.append([cell] if fits else textwrap.wrap(cell, width, subsequent_indent=indent))
        count = max(map(len, columns))
        padded = [
            [text.ljust(width) if n in words else text.rjust(width) for text in column]
            + [" " * width] * (count - len(column))
            for n, (column, width) in enumerate(zip(columns, widths, strict=True))
        ]
        return [_GAP.join(parts).rstrip() for parts in zip(*padded, strict=True)]


def _shrink(widths: list[int], room: int, shrinkable: Sequence[int]) -> None:
    """Narrow the widest shrinkable column by one character until all columns fit into `room`."""
    while shrinkable and sum(widths) > room:
        widest = max(shrinkable, key=lambda n: widths[n])
        if widths[widest] <= _NARROWEST:
            return
        widths[widest] -= 1
