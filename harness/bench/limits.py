"""Benchmark statements that hold a measured value to a limit, and the outcome of several."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from harness.core.number_format import NOT_MEASURED, count_noun
from harness.errors import Outcome
from harness.results.findings import BenchmarkStatement, Verdict


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
