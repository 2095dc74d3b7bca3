"""The effort of a question: how many cells its search may use, whatever the computer and its load.

A cell of five seconds takes 0.15 to 0.4 s of an otherwise idle core with `expert_map`, a third of that with `ik`, and
the first cell of a clip about a second more. A usual question is three of eight places for one behaviour, 56 sets.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from harness.results.findings.advice import Effort

DEFAULT_EFFORT: Effort = "normal"
FINALISTS = 4
"""Sets of one size that are measured on all units, unless they are significantly worse than the best of them."""


@dataclass(frozen=True)
class Budget:
    """What a search may use."""

    cells: int
    """Most cells on which sets are chosen; the held-out clips and the second method come on top."""
    minutes: float
    """About how long all of it takes on two quiet cores [min]."""


@dataclass(frozen=True)
class CellForecast:
    """About how many cells a question takes."""

    choose: int
    """Cells on which sets are chosen."""
    test: int
    """Cells of the chosen sets on held-out clips."""
    repeat: int
    """Cells of the second method."""

    @property
    def total(self) -> int:
        """All of them."""
        return self.choose + self.test + self.repeat


EFFORTS: Mapping[Effort, Budget] = {
    "quick": Budget(300, 1.0),
    "normal": Budget(1200, 4.0),
    "thorough": Budget(4000, 12.0),
}
"""Effort -> its budget, the least first."""
CLIPS_BUDGET = Budget(20_000, 60.0)
"""The budget where a question names its number of clips."""


def effort_within(minutes: float) -> Effort:
    """The most thorough effort that takes at most so long on two quiet cores; the least one where none does."""
    fitting = [effort for effort, budget in EFFORTS.items() if budget.minutes <= minutes]
    return fitting[-1] if fitting else next(iter(EFFORTS))


def plan_rounds(sets: Sequence[int], units: int, clips: int, cells: int) -> tuple[int, ...]:
    """Numbers of units on which the rounds of a search by halves compare sets; () where one round is too much already.

    `sets` has the number of sets of each size, `units` is the number of units there are, and `clips` that of the clips
    of a unit. The first round has as many units as `cells` allow for all rounds; each further one twice as many.
    """
    first = [units, *(2**power for power in range(units.bit_length(), -1, -1) if 2**power < units)]
    ladders = [_double(begin, units) for begin in first]
    for ladder in ladders:
        if count_cells(sets, ladder, clips) <= cells:
            return ladder
    return ladders[-1] if 2 * sum(sets) * clips <= cells else ()


def _double(first: int, most: int) -> tuple[int, ...]:
    """`first`, twice as many and so on, up to `most`."""
    ladder = [first]
    while ladder[-1] < most:
        ladder.append(min(2 * ladder[-1], most))
    return tuple(ladder)


def count_cells(sets: Sequence[int], ladder: Sequence[int], clips: int) -> int:
    """The most cells that the rounds of a search by halves use."""
    used, _ = last_round(sets, ladder, clips, math.inf)
    return used


def last_round(sets: Sequence[int], ladder: Sequence[int], clips: int, cells: float) -> tuple[int, int]:
    """The cells that a search by halves uses where no set is significantly worse, and the units of its last round.

    No round after the first is begun for which `cells` do not suffice.
    """
    left, used, before = list(sets), 0, 0
    for units in ladder:
        needed = sum(left) * (units - before) * clips
        if before and used + needed > cells:
            break
        left, used, before = [keep_count(count) for count in left], used + needed, units
    return used, before


def keep_count(sets: int) -> int:
    """How many of so many sets a round keeps."""
    return min(sets, max(-(-sets // 2), FINALISTS))
