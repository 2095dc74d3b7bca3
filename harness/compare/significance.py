"""Whether differences are more than chance and whether they matter: sign flips, Holm's correction, verdicts.

If A and B were equally good, each clip's difference could as well have the other sign. The p of a line is the share of
all such flips whose mean is as far from zero as the one that was found (Fisher's randomisation test): exact for up to
16 clips, by 20,000 draws of a named generator for more. Holm 1979 corrects for the number of gated lines. A line
whose sides agree in every clip can never be found to differ and does not count among them (Tarone 1990).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from harness.compare.paired_statistics import MIN_CLIPS, bootstrap_interval, round_to_grid
from harness.core.arrays import Floats
from harness.core.seeds import generator

Verdict = Literal["better", "same", "worse", "cannot tell"]
SIGNIFICANCE = 0.05
_EXACT_CLIPS, _DRAWS = 16, 20_000


@dataclass(frozen=True)
class SignificanceResult:
    """What paired differences come to."""

    verdict: Verdict
    why: str
    low: float | None = None
    """End of the 95 % interval of the mean; None with fewer clips than `MIN_CLIPS`, as all that follows."""
    high: float | None = None
    p: float | None = None
    p_holm: float | None = None
    """As it counts among all lines."""


def decide_verdicts(lines: Sequence[Floats], margins: Sequence[float]) -> list[SignificanceResult]:
    """Of lines that are judged together, each (clips,) differences and the margin in their unit; a rise is worse.

    *Worse* and *better*: p after Holm at most 0.05, the interval excludes zero, and the mean is beyond the margin.
    *Same*: the whole interval lies within the margin. Anything else cannot be told.
    """
    tested = [at for at, line in enumerate(lines) if len(line) >= MIN_CLIPS]
    p = {at: sign_flip_p(lines[at]) for at in tested}
    counting = [at for at in tested if np.any(lines[at])]
    corrected = dict(zip(counting, holm([p[at] for at in counting]), strict=True))
    found = []
    for at, (line, margin) in enumerate(zip(lines, margins, strict=True)):
        if at not in p:
            found.append(SignificanceResult("cannot tell", f"too few clips: {len(line)}, of at least {MIN_CLIPS}"))
            continue
        low, high = bootstrap_interval(line)
        p_holm = corrected.get(at, 1.0)
        told = _verdict(line, low, high, p_holm, margin, len(counting))
        found.append(SignificanceResult(*told, low, high, p[at], p_holm))
    return found


def _verdict(line: Floats, low: float, high: float, p: float, margin: float, lines: int) -> tuple[Verdict, str]:
    mean, apart = float(line.mean()), low > 0.0 or high < 0.0
    if p <= SIGNIFICANCE and apart and abs(mean) > margin:
        return ("worse" if mean > 0.0 else "better"), "more than chance, and more than the margin"
    if -margin <= low and high <= margin:
        return "same", "the whole interval lies within the margin"
    if lines * smallest_possible_p(line) > SIGNIFICANCE:
        return "cannot tell", f"too few clips: {len(line)} can show nothing among {lines} lines"
    if p > SIGNIFICANCE and apart:
        return "cannot tell", f"among {lines} lines it may be chance"
    if apart:
        return "cannot tell", "they differ, perhaps by more than the margin"
    return "cannot tell", "the interval holds zero and reaches beyond the margin"


def sign_flip_p(difference: Floats) -> float:
    """Two-sided p of the mean of (n,) differences; 1 if all are zero."""
    if not np.any(difference):
        return 1.0
    values = round_to_grid(difference)
    extreme = int(np.count_nonzero(np.abs(_sign_flips(len(values)) @ values) >= abs(values.sum())))
    if len(values) <= _EXACT_CLIPS:
        return extreme / float(2 ** (len(values) - 1))
    return (1 + extreme) / (1 + _DRAWS)  # what was found is one of the flips


def smallest_possible_p(difference: Floats) -> float:
    """The smallest p that differences of these sizes could have had: that of all on one side."""
    return sign_flip_p(np.abs(difference))


@lru_cache(maxsize=32)
def _sign_flips(count: int) -> Floats:
    """(F, count) of -1 and 1; where all are asked for the last is never flipped, for the other half mirrors this."""
    if count <= _EXACT_CLIPS:
        flips = np.arange(2 ** (count - 1))[:, None] >> np.arange(count) & 1
    else:
        flips = generator(0, "sign flips", count).integers(0, 2, (_DRAWS, count))
    return 1.0 - 2.0 * flips.astype(float)


def holm(p: Sequence[float]) -> list[float]:
    """Each p as it counts among all of them (Holm 1979): the least times their number, the next times one less, …"""
    order = sorted(range(len(p)), key=lambda at: p[at])
    corrected, highest = [0.0] * len(p), 0.0
    for rank, at in enumerate(order):
        highest = max(highest, min(1.0, (len(p) - rank) * p[at]))
        corrected[at] = highest
    return corrected
