"""One line of `harness bench`: what was measured, beside what it is held to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields


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
    """A table of rows, one a line."""
    lines = [("what", "measured", "", "held to", "measured against, in the same run")]
    lines += [
        (r.name, f"{r.value:,.3g}" if r.value < 100 else f"{r.value:,.0f}", r.unit, r.target, r.reference) for r in rows
    ]
    widths = [max(len(line[i]) for line in lines) for i in range(5)]
    aligned = [
        f"{a:<{widths[0]}}  {b:>{widths[1]}} {c:<{widths[2]}}  {d:<{widths[3]}}  {e}".rstrip()
        for a, b, c, d, e in lines
    ]
    return "\n".join(aligned)
