"""A statement with a target, a measured value and a verdict: a row of a benchmark, a truth table or a paper study."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Literal

from harness.core.number_format import NOT_MEASURED, count_noun
from harness.errors import Outcome

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


def state_verdict(
    text: str, target: str, measured: str, met: bool | None, reference: str = "", why: str = "", **fields: Any
) -> BenchmarkStatement:
    """A statement of our own; `met` is None where the run gives no verdict."""
    verdict: Verdict = "no verdict" if met is None else "met" if met else "missed"
    return BenchmarkStatement(
        text, target, measured, verdict if target else "", why, kind="", reference=reference, **fields
    )


def hold_to_limit(
    text: str,
    value: float,
    unit: str = "",
    *,
    least: float | None = None,
    most: float | None = None,
    reference: str = "",
    doubt: str = "",
    more: Mapping[str, Any] | None = None,
) -> BenchmarkStatement:
    """A statement that a value is at `least` or at `most` a limit; without a limit the value is for information.

    NaN is no measurement and has no verdict. `doubt` says why this run cannot give one.
    """
    target = f">= {least:g}" if least is not None else "" if most is None else f"<= {most:g}" if most else "0"
    known = math.isfinite(value)
    met = _is_within(value, least, most)
    measured = f"{_write_beside(value, least, most)} {unit}".rstrip() if known else NOT_MEASURED
    why = doubt or ("" if known or not target else "nothing was measured")
    return state_verdict(
        *(text, target, measured, met if known and not doubt else None, reference, why if target else ""),
        value=value if known else None,
        unit=unit,
        more=dict(more or {}),
    )


def _is_within(value: float, least: float | None, most: float | None) -> bool:
    return (least is None or value >= least) and (most is None or value <= most)


def _write_beside(value: float, least: float | None, most: float | None) -> str:
    """A value with three digits, or with as many as show on which side of its limit it lies."""
    for digits in range(3, 17):
        text = f"{value:,.0f}" if abs(value) >= 100.0 and digits == 3 else f"{value:,.{digits}g}"
        if _is_within(float(text.replace(",", "")), least, most) == _is_within(value, least, most):
            return text
    return repr(value)


def outcome_of(statements: Sequence[BenchmarkStatement]) -> Outcome:
    """REGRESSED with a missed target, NOT_COMPARABLE without any statement or where a target has no verdict."""
    verdicts = {statement.verdict for statement in statements}
    if "missed" in verdicts:
        return Outcome.REGRESSED
    return Outcome.NOT_COMPARABLE if "no verdict" in verdicts or not statements else Outcome.PASS


def count_missed(statements: Sequence[BenchmarkStatement]) -> str:
    """The last line of a benchmark, such as "3 of 15 targets missed, 1 without a verdict"."""
    verdicts = [statement.verdict for statement in statements if statement.target]
    if not verdicts:
        return "no target: the figures are for information"
    without = f", {unknown} without a verdict" if (unknown := verdicts.count("no verdict")) else ""
    return f"{verdicts.count('missed')} of {count_noun(len(verdicts), 'target')} missed{without}"
