"""Rows of `harness bench`: a measured value, its reference and its target."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields


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
    lines = [("quantity", "measured", "", "target", "reference, in the same run")]
    lines += [
        (r.name, f"{r.value:,.3g}" if r.value < 100 else f"{r.value:,.0f}", r.unit, r.target, r.reference) for r in rows
    ]
    widths = [max(len(line[i]) for line in lines) for i in range(5)]
    aligned = [
        f"{a:<{widths[0]}}  {b:>{widths[1]}} {c:<{widths[2]}}  {d:<{widths[3]}}  {e}".rstrip()
        for a, b, c, d, e in lines
    ]
    return "\n".join(aligned)
