"""Rows of numbers in a text file: separator, decimal sign, header lines and rows, read in pieces.

Commas, semicolons, tabs and blanks separate. With the latter three the decimal sign may be a comma. Lines that begin
with `#`, `%` or `//` are comments. Those before the first row belong to the header: some programs name columns so.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.csv_text import unescape_formula
from harness.core.file_kind import file_kind, wrong_file
from harness.core.input_file import MEGABYTE, open_input_file
from harness.errors import BadFile, Outcome
from harness.stream.poses.clock_text import parse_clock
from harness.stream.poses.dtrack_text import DTrackText

EXPECTED_FILE = "timed poses in rows of numbers (TUM, EuRoC, CSV, matrices)"
MAX_BYTES = 2048 * MEGABYTE
MOST_COLUMNS = 20_000
_HEAD_CHARACTERS = MEGABYTE
"""Beginning of a file from which separator, header and columns are concluded."""
_PIECE_CHARACTERS = 4 * MEGABYTE
_LONGEST_LINE = 8 * MEGABYTE
_MOST_NAMES = 1000
_MOST_ABOVE = 2
"""Most header lines that hold numbers alone, as those of OptiTrack with identifiers; nothing stands in their first
cell."""
_COMMENT = re.compile(r"\s*(#|%|//)+")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,9})?")
_WORDS = {
    **dict.fromkeys(("", "nan", "na", "n/a", "null", "none", "-", "--", "inf", "-inf", "+inf"), np.nan),
    **{"true": 1.0, "false": 0.0, "yes": 1.0, "no": 0.0, "wahr": 1.0, "falsch": 0.0},
}
"""Words in columns of numbers -> what they stand for."""
_NUMBER_WORD = re.compile(r'[ "]*(true|false|yes|no|wahr|falsch|[\d/-]*[T_ ]?\d+:\d\d:)', re.IGNORECASE)
_MARKUP = {"JSON": re.compile(r'\s*(\{|\[\s*[\[{"])'), "XML": re.compile(r"\s*<[?!\w]")}
"""Text that is no table -> how it begins."""
_FORMS = ((",", "."), (";", "."), ("\t", "."), (None, "."), (";", ","), ("\t", ","), (None, ","))
"""Separators (None: blanks) and decimal signs; the first of equally good ones counts."""
_SEPARATOR_NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", None: "blanks"}


@dataclass(frozen=True, eq=False)
class TableHead:
    """The form of a table, and its beginning."""

    path: Path
    separator: str | None
    """None for blanks."""
    decimal: str
    header: tuple[tuple[str, ...], ...]
    """Cells of the lines before the first row, without comment signs and empty lines."""
    first_line: int
    """Number of the line of the first row, from 1."""
    columns: int
    text_columns: frozenset[int]
    """Columns, from 0, that hold words."""
    word_columns: frozenset[int]
    """Columns of numbers that are written as words: true and false, dates and times of day (`parse_clock`)."""
    rows: Floats
    """(N, columns) the rows of the head; NaN for words and empty cells."""

    @property
    def form(self) -> str:
        """Number of columns, separator and decimal sign in words."""
        decimal = ", decimal commas" if self.decimal == "," else ""
        return f"{self.columns} columns separated by {_SEPARATOR_NAMES[self.separator]}{decimal}"


@dataclass(frozen=True, eq=False)
class NumberTable:
    """The rows of some columns."""

    numbers: Floats
    """(N, C) numbers of the chosen columns; NaN in empty cells."""
    names: tuple[str, ...]
    """The different words of the column of names; empty without one."""
    name_of: Ints
    """(N,) index into `names` of each row; 0 without such a column."""
    left_out: tuple[str, ...]
    """What was left out, a clause each."""
    ends_whole: bool
    """Whether the last line ends with a line end, so that it was not cut."""


def read_head(path: Path) -> TableHead:
    """Conclude the form of a table from its beginning. Raises BadFile for a file without rows of numbers."""
    data, utf16 = _read_beginning(path)
    if not utf16 and (kind := file_kind(path)):
        raise wrong_file(path, kind, EXPECTED_FILE, "Check the path.")
    if markup := next((name for name, begin in _MARKUP.items() if begin.match(data)), ""):
        advice = "Write its poses as CSV with the columns time,x,y,z,qx,qy,qz,qw."
        raise BadFile(path, f"{markup}, no rows of numbers", EXPECTED_FILE, advice)
    lines = data.split("\n")
    if len(data) == _HEAD_CHARACTERS:
        lines.pop()  # it may go on
    numbered = [(number, line) for number, line in enumerate(lines, 1) if line.strip()]
    plain = [line for _, line in numbered if not _COMMENT.match(line) and line.strip() != Outcome.PASS.word]
    last = plain[-max(2, min(50, len(plain) // 4)) :]
    separator, decimal = max(_FORMS, key=lambda form: _count_numbers(last, *form))
    split = [_split(line, separator) for line in last]
    columns = max(Counter(map(len, split)).items(), key=lambda pair: (pair[1], pair[0]), default=(0, 0))[0]
    by_column = list(zip(*(row for row in split if len(row) == columns), strict=True))
    texts = frozenset(
        c
        for c, cells in enumerate(by_column)
        if 2 * sum(_parse_cell(cell, decimal) is None for cell in cells) > len(cells)
    )
    words = frozenset(c for c, cells in enumerate(by_column) if c not in texts and any(map(_NUMBER_WORD.match, cells)))
    header, above = list[tuple[str, ...]](), list[tuple[str, ...]]()
    rows: list[list[float]] = []
    first_line = 0
    if _count_numbers(last, separator, decimal) >= 2 and columns <= MOST_COLUMNS:
        for number, line in numbered:
            comment = _COMMENT.match(line)
            row_cells = tuple(_split(line[comment.end() :] if comment else line, separator))
            row = None if comment else _parse_row(row_cells, columns, texts, decimal)
            fewest = 1 if all(row_cells) else min(2, columns - len(texts))
            if row is not None and (rows or np.isfinite(row).sum() >= fewest):
                first_line = first_line or number
                rows.append(row)
                above = [*above, row_cells][:_MOST_ABOVE]
            elif not rows:
                header.append(row_cells)
            elif not comment and len(rows) <= _MOST_ABOVE and np.isnan([row[0] for row in rows]).all():
                header += [*above, row_cells]
                rows, above, first_line = [], [], 0
    if not rows:
        raise BadFile(path, "no rows of numbers", EXPECTED_FILE, "Is it the right file?")
    return TableHead(path, separator, decimal, tuple(header), first_line, columns, texts, words, np.array(rows))


def _read_beginning(path: Path) -> tuple[str, bool]:
    """The beginning of a file, and whether it is UTF-16. Raises BadFile for an empty or binary one."""
    with _open_text(path) as file:
        text = file.read(_HEAD_CHARACTERS)
        utf16 = file.encoding == "utf-16"
    if "\0" in text or not text.strip():
        found = "binary data" if "\0" in text else "an empty file"
        raise wrong_file(path, found, EXPECTED_FILE, "Check the path.")
    return text, utf16


def _open_text(path: Path) -> io.TextIOBase:
    """A file as text with line ends of one kind; UTF-16 where its first bytes say so. Raises BadFile."""
    file = open_input_file(path, EXPECTED_FILE, MAX_BYTES)
    utf16 = file.read(2) in (b"\xff\xfe", b"\xfe\xff")
    file.seek(0)
    text = io.TextIOWrapper(file, "utf-16" if utf16 else "utf-8-sig", errors="replace")
    is_dtrack = DTrackText.recognises(text.readline(_LONGEST_SHOWN))
    text.seek(0)
    return DTrackText(text) if is_dtrack else text


def _split(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    except csv.Error:  # a field of more than 131,072 characters
        return [cell.strip(' "') for cell in line.split(separator)]


def _parse_cell(cell: str, decimal: str = ".") -> float | None:
    """What a cell of a column of numbers stands for, NaN for a missing number; None for another word."""
    cell = cell.strip(' \t"')
    number = cell.replace(",", ".") if decimal == "," else cell
    return float(number) if _NUMBER.fullmatch(number) else _WORDS.get(cell.lower(), parse_clock(cell))


def _convert(cell: str) -> float:
    """`_parse_cell` for numpy. Raises ValueError."""
    value = _parse_cell(cell)
    if value is None:
        raise ValueError
    return value


def _count_numbers(lines: Sequence[str], separator: str | None, decimal: str) -> float:
    """Median number of numbers in a line."""
    rows = [[_parse_cell(cell, decimal) for cell in _split(line[:_LONGEST_SHOWN], separator)] for line in lines]
    return float(np.median([sum(cell == cell for cell in row if cell is not None) for row in rows] or [0]))


_LONGEST_SHOWN = 1 << 16
"""Characters of a line by which separators are compared."""


def _parse_row(cells: Sequence[str], columns: int, texts: frozenset[int], decimal: str) -> list[float] | None:
    """The numbers of a row, NaN for words of text columns and empty cells; None for a line that is no row."""
    if len(cells) != columns:
        return None
    row = [np.nan] * columns
    for c, cell in enumerate(cells):
        if c in texts:
            continue
        if (value := _parse_cell(cell, decimal)) is None:
            return None
        row[c] = value
    return row


def read_rows(head: TableHead, columns: Sequence[int], name_column: int | None = None) -> NumberTable:
    """Read the rows of some columns, and of one that holds the name of a body. Raises BadFile with the line."""
    reader = _RowReader(head, columns, name_column)
    parts = [reader.read(*piece) for piece in _pieces(head)]
    name_of = np.concatenate([codes for _, codes in parts])
    numbers, begin = np.empty((len(name_of), len(columns))), 0
    while parts:  # each is released once it is copied
        part, _ = parts.pop(0)
        numbers[begin : (begin := begin + len(part))] = part
    left_out = tuple(f"{count} {what}" for what, count in reader.left_out.items())
    cleaned = [unescape_formula(word.strip(' \t"')) for word in reader.names]
    names = tuple(dict.fromkeys(cleaned))
    if len(names) < len(cleaned):
        name_of = np.array([names.index(name) for name in cleaned], dtype=np.int64)[name_of]
    return NumberTable(numbers, names, name_of, left_out, reader.ends_whole)


def _pieces(head: TableHead) -> Iterator[tuple[int, str, bool]]:
    """Whole lines from the first row on: number of the first line, text, and whether the file ends with it."""
    with _open_text(head.path) as file:
        for _ in range(head.first_line - 1):
            file.readline(_LONGEST_LINE)
        number, kept = head.first_line, ""
        while text := file.read(_PIECE_CHARACTERS):
            whole, end, rest = (kept + text).rpartition("\n")
            if end:
                yield number, whole + end, False
                number += whole.count("\n") + 1
            kept = rest
            if len(kept) > _LONGEST_LINE:
                raise BadFile(head.path, "a line of more than 8 MB", EXPECTED_FILE, "Is it the right file?", number)
        yield number, kept, True


class _RowReader:
    """Reads the pieces of a file one after another."""

    def __init__(self, head: TableHead, columns: Sequence[int], name_column: int | None) -> None:
        self.names: dict[str, int] = {}
        self.left_out: Counter[str] = Counter()
        self.ends_whole = True
        self._head, self._columns, self._name_column = head, list(columns), name_column
        words: frozenset[int | str] = head.word_columns.intersection(columns)
        self._converters: dict[int | str, Callable[[str], float]] = dict.fromkeys(words, _convert)
        self._header_rows = {row for row in head.header if len(row) == head.columns}

    def read(self, first_line: int, text: str, last: bool) -> tuple[Floats, Ints]:
        """The numbers (N, C) and the codes of the names (N,) in whole lines."""
        self.ends_whole = not (last and text)
        plain = text.replace(",", ".") if self._head.decimal == "," else text
        lines = [line for line in plain.split("\n") if line and not line.isspace()]
        if not lines:
            return np.empty((0, len(self._columns))), np.empty(0, dtype=np.int64)
        numbers, comments = self._load(lines), 0
        if numbers is None:
            filled = [line for line in self._fill("\n".join(lines)).split("\n") if not _COMMENT.match(line)]
            numbers, comments, lines = self._load(filled), len(lines) - len(filled), filled
        if numbers is None:
            return self._read_lines(first_line, text, last)
        if comments:
            self.left_out["comment lines"] += comments
        return numbers, self._codes(lines)

    def _fill(self, text: str) -> str:
        """The text with `nan` in empty cells, and without quotes."""
        text, sign = text.replace('"', ""), self._head.separator
        if sign is None:
            return text
        for empty, filled in ((sign + sign, f"{sign}nan{sign}"),) * 2 + (
            (f"{sign}\n", f"{sign}nan\n"),
            (f"\n{sign}", f"\nnan{sign}"),
        ):
            text = text.replace(empty, filled)
        return f"{'nan' if text.startswith(sign) else ''}{text}{'nan' if text.endswith(sign) else ''}"

    def _load(self, lines: list[str]) -> Floats | None:
        """The numbers of lines that all have the form of the table; None if one has not."""
        separator, columns = self._head.separator, self._head.columns
        if not lines:
            return np.empty((0, len(self._columns)))
        if separator is not None and not all(line.count(separator) == columns - 1 for line in lines):
            return None
        every = separator is None and not self._head.text_columns  # then the number of cells is checked
        try:
            table = np.loadtxt(
                lines,
                delimiter=separator,
                usecols=None if every else self._columns,
                comments=None,
                ndmin=2,
                converters=self._converters,
            )
        except ValueError:
            return None
        if every and table.shape[1] != columns:
            return None
        out: Floats = table[:, self._columns] if every else table
        return out

    def _codes(self, lines: list[str]) -> Ints:
        column, separator = self._name_column, self._head.separator
        if column is None:
            return np.zeros(len(lines), dtype=np.int64)
        words = [line.split(separator, column + 1)[column] for line in lines]
        return np.array([self._code(word) for word in words], dtype=np.int64)

    def _code(self, word: str) -> int:
        code = self.names.setdefault(word, len(self.names))
        if code >= _MOST_NAMES:
            found = f"more than {_MOST_NAMES} different words in the column of names"
            raise BadFile(self._head.path, found, "the names of bodies", "Name the columns with --columns.")
        return code

    def _read_lines(self, first_line: int, text: str, last: bool) -> tuple[Floats, Ints]:
        """Read lines one by one: pieces with comments, quotes, words for missing numbers, or a damaged line."""
        head, rows, codes = self._head, [], []
        lines = text.split("\n")
        for number, line in enumerate(lines, first_line):
            if not line.strip():
                continue
            cells = _split(line, head.separator)
            row = _parse_row(cells, head.columns, head.text_columns, head.decimal)
            if _COMMENT.match(line):
                self.left_out["comment lines"] += 1
            elif tuple(cells) in self._header_rows:
                self.left_out["repeated header lines"] += 1
            elif row is not None:
                rows.append([row[c] for c in self._columns])
                codes.append(0 if self._name_column is None else self._code(cells[self._name_column]))
            elif last and line is lines[-1]:
                self.left_out["row cut off at the end"] += 1
            elif cells != [Outcome.PASS.word]:  # the last line of a command's output
                found = f"a line of {len(cells)} cells" if len(cells) != head.columns else "a word among the numbers"
                raise BadFile(head.path, found, f"a row of {head.form}", "Correct or remove this line.", number)
        return np.array(rows, dtype=np.float64).reshape(-1, len(self._columns)), np.array(codes, dtype=np.int64)
