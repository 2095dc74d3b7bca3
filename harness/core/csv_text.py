"""Lines of comma-separated values whose names no spreadsheet takes for formulas.

A text that begins with one of `=+-@`, a tab or a line break is a formula to a spreadsheet, unless it is a number. Such
a text gets an apostrophe in front (OWASP, "CSV Injection"), and so does one that already has apostrophes there. Readers
take one away, so every text reads back as it was.
"""

import csv
import re
from collections.abc import Iterable

_FORMULA = re.compile("'*[=+\\-@\t\r\n＝＋－＠]")  # spreadsheets take the wide signs for the others
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def csv_line(fields: Iterable[object]) -> str:
    """A line of a table, with its newline; texts are names and are escaped, None is an empty field."""
    line: str = _LINES.writerow([escape_formula(f) if isinstance(f, str) else f for f in fields])
    return line


def escape_formula(text: str) -> str:
    """The text as it stands in a field: a number as it is, a formula with an apostrophe in front."""
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def unescape_formula(field: str) -> str:
    """The text of a field that `escape_formula` wrote."""
    return field[1:] if field.startswith("'") and _FORMULA.match(field) else field


class _Line:
    """File of a csv writer, which returns what `write` returns."""

    def write(self, line: str) -> str:
        return line[:-2] + "\n"


_LINES = csv.writer(_Line(), lineterminator="\r\n")  # so that both are quoted in a field
