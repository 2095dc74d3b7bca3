"""Status of a station: quality, the ranges received and rejected lately, and when it is lost."""

from harness.core.arrays import Ints
from harness.core.compiled import compiled

LOST, CONFIRMING, TRACKING, DOUBTED = 0, 1, 2, 3
"""Without a fix; with a fix that further ranges have not yet confirmed; with a confirmed one; with one whose position
has become too uncertain. Records show quality 0 for all but the third."""
CYCLE_SLOTS = 6
"""Slots whose ranges `MP` counts: at most twelve ranges of two microphones (docs/is900.md 7)."""
LEAST_QUALITY = 1.0 / 255.0
"""Quality of a station that tracks: the least that a record tells from lost (docs/is900.md 7)."""


@compiled
def sum_last(counts: Ints, slot: int, slots: int) -> int:
    """Sum of the counts of the last slots, up to `slot`, in a ring (N,) with one entry per slot."""
    total = 0
    for k in range(slots):
        total += counts[(slot - k) % len(counts)]
    return total


@compiled
def quality(state: int, sigma_m: float, received: int, rejected: int, best_sigma_m: float) -> float:
    """Quality in 0..1 [choice]: `best_sigma_m` over the position's standard deviation [m], at most 1.

    The share of accepted ranges scales it by 0.5 to 1. A station without a confirmed fix has 0.
    """
    if state != TRACKING:
        return 0.0
    share = (received - rejected) / received if received > 0 else 0.0
    precision = min(1.0, best_sigma_m / sigma_m) if sigma_m > 0.0 else 1.0
    return max(LEAST_QUALITY, precision * (0.5 + 0.5 * share))
