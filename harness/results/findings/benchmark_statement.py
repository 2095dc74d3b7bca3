"""A statement with a target, a measured value and a verdict: a row of a benchmark, a truth table or a paper study."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Literal

Verdict = Literal[
    "reproduced",
    "same",
    "not reproduced",
    "cannot tell",
    "not comparable",
    "not run",
    "met",
    "missed",
    "no verdict",
    "",
]
"""Verdict on a statement.

A paper's statement has one by the paired 95 % interval of the difference. *reproduced*: it lies on the published side;
*same*: it lies within the margin of `compare.margins`, so the difference is too small to matter; *not reproduced*: it
lies on the other side; *cannot tell*: it contains zero, there are too few units, or the difference is not significant
after Holm's correction; *not comparable*: absolute figures of other motion; *not run*: not measured.

Our own targets are *met* or *missed*; *no verdict*: nothing was measured, or the run cannot tell. "" is a figure
without a target, for information.
"""
StatementKind = Literal["printed", "derived", "repeated", "speed", ""]
"""Kind of a paper's statement.

*printed*: the paper prints it; *derived*: it follows from printed ones, or is our reading of a word; *repeated*: a
printed statement asked of one more method; *speed*: today's speed against the paper's. Only printed statements count in
the headline. "" is a statement of our own.
"""
Reading = Literal["", "as printed", "ours"]
"""Methods of a paper's statement: the paper's as printed, our best, or "" where it is not about a method."""


@dataclass(frozen=True)
class BenchmarkStatement:
    """One statement, what it is held to, and what was measured."""

    STORED_NAMES: ClassVar[Mapping[str, str]] = {"published": "target", "ours": "measured", "difference": "value"}
    """Keys in files of earlier versions -> fields."""

    text: str
    """The statement, such as "walking, position + orientation: dynamic_map errs less than ik"."""
    target: str
    """What it is held to: a limit, such as "<= 5"; a published figure, or "order" where only bars are; "" without."""
    measured: str
    """The measured figure with its unit; "" where nothing was measured."""
    verdict: Verdict
    why: str = ""
    """Reason for the verdict: what differs, or what is missing; or how the figure was measured."""
    clips: int = 0
    """Number of units on which both sides were measured: performers, or clips where the scenario says so."""
    value: float | None = None
    """The measured figure in `unit`, such as a mean paired difference over units."""
    low: float | None = None
    high: float | None = None
    """Ends of the 95 % interval of `value`."""
    unit: str = ""
    kind: StatementKind = "printed"
    reading: Reading = ""
    p: float | None = None
    """Two-sided p of the difference; None where nothing was tested."""
    p_holm: float | None = None
    """`p` corrected for the number of printed statements of the paper with this reading (see `correct_claims`)."""
    reference: str = ""
    """Figure of the reference in the same run, or the publication that the target comes from."""
    more: dict[str, Any] = field(default_factory=dict)
    """Further entries of `as_dict`, for programs."""

    def as_dict(self) -> dict[str, Any]:
        """The entries of the JSON output of a benchmark."""
        content = asdict(self)
        more: dict[str, Any] = content.pop("more")
        return {**content, **more}
