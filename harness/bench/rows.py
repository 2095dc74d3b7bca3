"""One line of `harness bench`: what was measured, beside what it is held to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields

from harness.core.text_table import Table


@dataclass(frozen=True)
class BenchmarkRow:
    """A figure of one run; figures of different runs or machines are compared through `reference` only."""

    name: str
    """What was measured, such as "ik, six trackers, converged"."""
    value: float
    """The figure itself, in `unit`."""
    unit: str
    """Such as "frames/s"."""
    reference: str
    """What it was measured against in the same run, or "" when it stands alone."""
    target: str
    """What it is held to, such as ">= 1500"; "" when it is for information."""
    more: Mapping[str, str | float] = field(default_factory=dict)
    """What else there is to say, for programs: further entries of `as_dict`."""

    def as_dict(self) -> dict[str, str | float]:
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "more"} | dict(self.more)


def format_rows(rows: Sequence[BenchmarkRow]) -> str:
    """A text table with one line for each row."""
    head = ["what", "measured", "target", "measured against, in the same run"]
    cells = [[row.name, f"{_format_value(row.value)} {row.unit}".rstrip(), row.target, row.reference] for row in rows]
    return "\n".join(Table(head, cells, text_columns=len(head)).lines())


def _format_value(value: float) -> str:
    return f"{value:,.3g}" if value < 100 else f"{value:,.0f}"
