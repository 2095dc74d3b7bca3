"""Two sides compared metric by metric on the cells that they share: A is the reference, a difference is B - A."""

from dataclasses import dataclass
from typing import Literal

from harness.errors import Outcome

Verdict = Literal["better", "same", "worse", "cannot tell"]


@dataclass(frozen=True)
class Difference:
    """One method, one metric, C clips: a line of the comparison."""

    method: str
    """Or "a vs b" where two methods are compared."""
    group: str
    """What is never pooled: inputs, protocol and whether the performer was known, as one text."""
    metric: str
    unit: str
    clips: tuple[str, ...]
    """(C,) on which both sides were measured, sorted."""
    a: tuple[float, ...]
    """(C,) mean over the cells of each clip."""
    b: tuple[float, ...]
    """(C,) likewise."""
    mean_a: float
    mean_b: float
    difference: float
    """Mean of b - a."""
    low: float | None
    """End of its 95 % interval (see `paired.interval`); None with too few clips."""
    high: float | None
    p: float | None
    """Of a difference at least as large if A and B were alike (see `significance.sign_flip_p`); None likewise."""
    p_holm: float | None
    """The same, for as many gated lines as there are; None likewise, and where the line is not gated."""
    margin: float
    """The largest difference without practical importance, in `unit`."""
    verdict: Verdict
    why: str
    """Of the verdict, in a few words."""
    gated: bool
    """Whether the outcome rests on it; other lines are for information."""


@dataclass(frozen=True)
class Comparison:
    """What B is beside A, and whether that can be said at all."""

    a: str
    """Title of the reference."""
    b: str
    differences: tuple[Difference, ...]
    """Method by method, gated lines first; none where inputs differ."""
    matched: int
    """Pairs of cells."""
    only_a: tuple[str, ...]
    """Names of cells without a partner."""
    only_b: tuple[str, ...]
    inputs_that_differ: tuple[str, ...]
    """Such as "tracker.rate_hz: 40 against 60", but for those that were allowed."""
    allowed: tuple[str, ...]
    """Those that were, and other faults that were let pass."""
    circumstances: tuple[tuple[str, str, str], ...]
    """Name, A's and B's value, of those that differ: what the comparison is about."""
    outcome: Outcome
    why: str
    """Of the outcome, in one sentence."""
    coverage: tuple[str, ...] = ()
    """Where the sides measured different shares of what was planned, or less than 95 % of it."""
    failed: tuple[str, ...] = ()
    """Planned cells that failed on either side, such as "A: ik on walking_p1_01"."""
