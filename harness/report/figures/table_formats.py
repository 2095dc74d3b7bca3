"""Formats of the table of a run: LaTeX with booktabs, Markdown, and CSV with all digits."""

import re
from collections.abc import Callable, Sequence

from harness.core.csv_text import csv_line
from harness.errors import UnknownName
from harness.report.figures.table import MetricValue, ResultsRow, ResultsTable, SideBySideTable
from harness.report.kit.text import metric_label

_LATEX = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "−": "$-$",
    "–": "--",
    "³": r"\textsuperscript{3}",
    "×": r"$\times$",
}
"""Character -> what LaTeX prints as it."""


def to_latex(table: ResultsTable) -> str:
    """A tabular environment with booktabs rules; a condition is named in its first row, and space precedes it."""
    columns = "l" * (len(table.condition_names) + 1) + "r" * (len(table.columns) + 1)
    lines = [
        r"% needs \usepackage{booktabs}",
        f"% {table.note}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        _latex_row([_escape_latex(title) for title in _titles(table)]),
        r"\midrule",
    ]
    before: tuple[str, ...] | None = None
    for row in table.rows:
        if before is not None and row.condition != before:
            lines.append(r"\addlinespace")
        texts = _condition_texts(table, row)
        condition = [""] * len(texts) if row.condition == before else map(_escape_latex, texts)
        values = [_latex_value(value) for value in row.values]
        lines.append(_latex_row([*condition, _escape_latex(row.method), str(row.clips), *values]))
        before = row.condition
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"]) + "\n"


def _latex_row(cells: Sequence[str]) -> str:
    text = f"{' & '.join(cells)} \\\\"
    return f"{{}}{text}" if text.startswith("[") else text  # a bracket would be the argument of the row before


def _latex_value(value: MetricValue) -> str:
    mean, interval = (_escape_latex(text) for text in value.formatted())
    return " ".join(part for part in (rf"\textbf{{{mean}}}" if value.bold else mean, interval) if part)


def _escape_latex(text: str) -> str:
    return "".join(_LATEX.get(sign, sign) for sign in text)


def to_markdown(table: ResultsTable) -> str:
    """A table as GitHub and MkDocs read it, and the note below it."""
    titles = _titles(table)
    texts = len(table.condition_names) + 1
    rules = ["---" if n < texts else "--:" for n in range(len(titles))]
    names = [markdown_code(row.method) for row in table.rows]
    rows = [
        [*map(_escape_markdown, _condition_texts(table, row)), name, str(row.clips), *map(_markdown_value, row.values)]
        for name, row in zip(names, table.rows, strict=True)
    ]
    lines = [f"| {' | '.join(cells)} |" for cells in (map(_escape_markdown, titles), rules, *rows)]
    return "\n".join([*lines, "", _escape_markdown(table.note)]) + "\n"


def _markdown_value(value: MetricValue) -> str:
    mean, interval = value.formatted()
    return f"{f'**{mean}**' if value.bold else mean} {interval}".strip()


def markdown_code(text: str) -> str:
    """A name as code: the fence is longer than any of its own backticks, and a bar would end the cell even here."""
    fence = "`" * (1 + max(map(len, re.findall("`+", text)), default=0))
    pad = " " if text.startswith("`") or text.endswith("`") else ""
    return f"{fence}{pad}{text}{pad}{fence}".replace("|", "\\|")


def _escape_markdown(text: str) -> str:
    escaped = "".join(f"\\{sign}" if sign in "\\|*_`<>&~$" else sign for sign in text)
    return escaped.replace("](", "]\\(")  # no link


def to_csv(table: ResultsTable) -> str:
    """A line for each row; a metric, or each of several results, has NAME, NAME.low, .high, .clips and .standing.

    Fields are empty where nothing was measured or ranked. Numbers have nine digits.
    """
    parts = ("", ".low", ".high", ".clips", ".standing")
    head = csv_line([*table.condition_names, "method", *(f"{name}{part}" for name in table.columns for part in parts)])
    fields = ([field for value in row.values for field in _csv_fields(value)] for row in table.rows)
    rows = (csv_line([*row.condition, row.method, *of]) for row, of in zip(table.rows, fields, strict=True))
    return "".join([head, *rows])


def _csv_fields(value: MetricValue) -> list[str]:
    numbers = ["" if number is None else f"{number:.9g}" for number in (value.mean, value.low, value.high)]
    return [*numbers, str(value.clips), value.standing]


def _titles(table: ResultsTable) -> list[str]:
    names = table.columns if isinstance(table, SideBySideTable) else map(metric_label, table.columns)
    return [*table.condition_names, "method", "clips", *names]


def _condition_texts(table: ResultsTable, row: ResultsRow) -> list[str]:
    """The condition of a row, with the label of a metric."""
    metrics = row.condition[: isinstance(table, SideBySideTable)]
    return [*map(metric_label, metrics), *row.condition[len(metrics) :]]


TABLE_FORMATS: dict[str, Callable[[ResultsTable], str]] = {"latex": to_latex, "markdown": to_markdown, "csv": to_csv}


def format_table(table: ResultsTable, fmt: str) -> str:
    """The table in one of TABLE_FORMATS; UnknownName for another one."""
    if fmt not in TABLE_FORMATS:
        raise UnknownName("format of tables", fmt, TABLE_FORMATS)
    return TABLE_FORMATS[fmt](table)
