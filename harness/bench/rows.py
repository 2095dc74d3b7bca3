"""Rows of `harness bench`: a measured value, its reference and its target."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields

from harness.core.text_table import Table


@dataclass(frozen=True)
class BenchmarkRow:
    """A value of one run. Compare runs or machines only by values that are relative to a reference of the same run."""

    name: str
    """Name of the quantity, such as "ik, six trackers, converged"."""
    value: float
    """The value, in `unit`."""
    unit: str
    """The unit, such as "frames/s"."""
    reference: str
    """The reference that was measured in the same run; "" without one."""
    target: str
    """The target, such as ">= 1500"; "" where the value is for information."""
    more: Mapping[str, str | float] = field(default_factory=dict)
    """Further entries of `as_dict`, for programs."""

    def as_dict(self) -> dict[str, str | float]:
        """The entries of the JSON output."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "more"} | dict(self.more)


def format_rows(rows: Sequence[BenchmarkRow]) -> str:
    """Format rows as a text table."""
    head = ["quantity", "measured", "target", "reference, in the same run"]
    cells = [[row.name, f"{_format_value(row.value)} {row.unit}".rstrip(), row.target, row.reference] for row in rows]
    return "\n".join(Table(head, cells, text_columns=len(head)).lines())


def _format_value(value: float) -> str:
    return f"{value:,.3g}" if value < 100 else f"{value:,.0f}"
