"""HTML rendering of a `Table`, and the cells that tables of several pages share."""

from typing import Any

from harness.core.number_format import NOT_MEASURED, format_number
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, join, scroll_box, tag

NOT_MEASURED_CELL = tag("span", NOT_MEASURED, class_="none")
"""Cell of a value that was not measured."""


def html_table(table: Table, caption: Any, *, label: str) -> Markup:
    """A table whose first column names the rows; a table wider than the page scrolls sideways on its own."""
    head = tag("tr", *(tag("th", cell, scope="col") for cell in table.head))
    body = [tag("tr", tag("th", row[0], scope="row"), *(tag("td", cell) for cell in row[1:])) for row in table.rows]
    content = tag("table", tag("thead", head), tag("tbody", *body), aria_label=label)
    return join(tag("p", caption, class_="caption"), scroll_box(content, label))


def count_note(n: int | str) -> Markup:
    """The number of sequences or clips behind a value, in small type: "n 5"; it never breaks across lines."""
    return tag("span", f" n\u00a0{n}", class_="spread")


def statistic_cell(mean: float | None, sd: float | None, unit: str, *, n: int, column_n: int) -> Markup:
    """Mean ± standard deviation over `n` sequences or clips; `n` is shown where it differs from its column's."""
    if mean is None:
        return NOT_MEASURED_CELL
    spread = None if sd is None else tag("span", f" ± {format_number(sd, unit)}", class_="spread")
    return join(format_number(mean, unit), spread, None if n == column_n else count_note(n))


def stacked_cell(upper: Any, lower: Any, class_: str = "spread under") -> Markup:
    """A cell of two lines, the lower one in small type; an empty lower line is left out."""
    return join(upper, tag("span", lower, class_=class_) if lower else None)
