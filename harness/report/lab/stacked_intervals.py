"""Tables of a page whose intervals stand below the numbers, so that they fit into a narrow window."""

from harness.core.text_table import Table
from harness.report.kit.table import stacked_cell

INTERVAL = "95 % interval"
"""Head of a column of intervals of the usual level; the column before it has the numbers."""


def stack_intervals(table: Table) -> Table:
    """The table with each interval below its number, in small type, and without the columns of intervals."""
    columns = [n for n, head in enumerate(table.head) if str(head).endswith("% interval")]
    kept = [n for n in range(len(table.head)) if n not in columns]

    def cell(row: list[object], n: int) -> object:
        ends = str(row[n + 1]) if n + 1 in columns else ""
        return stacked_cell(row[n], ends) if ends not in ("", "–") else row[n]

    rows = [[cell(list(row), n) for n in kept] for row in table.rows]
    return Table([table.head[n] for n in kept], rows, table.text_columns)
