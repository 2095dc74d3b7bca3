"""Verdicts on paired differences: sign-flip test, Holm's correction, practical importance.

If A and B were equally good, the difference of each unit could equally have the other sign. The p of a line is the
share of all sign flips whose mean is at least as far from zero as the observed mean (Fisher's randomisation test). It
is exact for up to 16 units; for more it uses 20,000 draws of a named generator. Holm 1979 corrects for the number of
gated lines. A line whose sides agree on every unit can never differ significantly and is not counted (Tarone 1990).
Nor is a line of fewer than `MIN_UNITS` units. Such a line can still be shown to be *same*, since equivalence needs an
interval within the margin and no p.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from harness.compare.paired_statistics import MIN_UNITS, mean_interval, round_to_grid
from harness.core.arrays import Floats
from harness.core.number_format import count_noun
from harness.core.seeds import generator

Verdict = Literal["better", "same", "worse", "cannot tell"]
SIGNIFICANCE = 0.05
_EXACT_UNITS, _DRAWS = 16, 20_000
_MAX_CACHED_UNITS, _DRAWS_AT_ONCE = 64, 500
"""Flips of more units are drawn anew, a part at a time, so that thousands of units fit into memory."""


@dataclass(frozen=True)
class SignificanceResult:
    """Verdict on the paired differences of one line."""

    verdict: Verdict
    why: str
    low: float | None = None
    """Lower end of the 95 % interval of the mean; None with fewer than two units, unless they have no difference."""
    high: float | None = None
    p: float | None = None
    """None, as `p_holm`, with fewer than `MIN_UNITS` units."""
    p_holm: float | None = None
    """`p` corrected for the number of lines."""


def decide_verdicts(
    lines: Sequence[Floats], margins: Sequence[float], decided: Collection[int] | None = None
) -> list[SignificanceResult]:
    """Decide on lines that are tested together; each has (units,) differences and a margin; an increase is worse.

    *Worse* and *better*: p after Holm is at most 0.05, the interval excludes zero, and the mean exceeds the margin.
    *Same*: the whole interval lies within the margin, or no unit differs. Anything else is undecided ("cannot tell").
    `decided` names the lines whose results are needed, by default all; the others count in the correction alone.
    """
    tested = [at for at, line in enumerate(lines) if len(line) >= MIN_UNITS]
    p = {at: sign_flip_p(lines[at]) for at in tested}
    counted = [at for at in tested if np.any(lines[at])]
    corrected = dict(zip(counted, holm([p[at] for at in counted]), strict=True))
    results = []
    for at in range(len(lines)) if decided is None else decided:
        line, margin = lines[at], margins[at]
        if at not in p:
            results.append(_decide_on_few_units(line, margin))
            continue
        low, high = mean_interval(line)
        p_holm = corrected.get(at, 1.0)
        verdict = _verdict(line, low, high, p_holm, margin, len(counted))
        results.append(SignificanceResult(*verdict, low, high, p[at], p_holm))
    return results


def _decide_on_few_units(line: Floats, margin: float) -> SignificanceResult:
    """*Same* or undecided: no p of fewer than `MIN_UNITS` units is small enough for a difference."""
    if len(line) and not np.any(line):
        return SignificanceResult("same", "no unit differs", 0.0, 0.0)
    low, high = mean_interval(line) if len(line) > 1 else (None, None)
    if low is not None and high is not None and -margin <= low and high <= margin:
        return SignificanceResult("same", "the whole interval lies within the margin", low, high)
    return SignificanceResult("cannot tell", f"too few units: {len(line)}, of at least {MIN_UNITS}", low, high)


def _verdict(line: Floats, low: float, high: float, p: float, margin: float, lines: int) -> tuple[Verdict, str]:
    mean, excludes_zero = float(line.mean()), low > 0.0 or high < 0.0
    if p <= SIGNIFICANCE and excludes_zero and abs(mean) > margin:
        return ("worse" if mean > 0.0 else "better"), "significant and larger than the margin"
    if -margin <= low and high <= margin:
        return "same", "the whole interval lies within the margin"
    if lines * smallest_possible_p(line) > SIGNIFICANCE:
        return "cannot tell", _describe_too_few(line, lines)
    if p > SIGNIFICANCE and excludes_zero:
        return "cannot tell", f"the difference is not significant among {count_noun(lines, 'line')}"
    if excludes_zero:
        return "cannot tell", "the sides differ, perhaps by more than the margin"
    return "cannot tell", "the interval contains zero and exceeds the margin"


def _describe_too_few(line: Floats, lines: int) -> str:
    differing, needed = int(np.count_nonzero(line)), count_needed(lines)
    those = f"{differing} differ" if differing < len(line) else f"{len(line)}"
    return f"too few units: {those}, and among {lines} lines a difference needs {needed}"


def count_needed(lines: int = 1, level: float = SIGNIFICANCE) -> int:
    """The least number of units that differ, all in one direction, with which one of `lines` can be significant."""
    return max(MIN_UNITS, math.ceil(1.0 + math.log2(max(lines, 1) / level)))


def sign_flip_p(difference: Floats) -> float:
    """Two-sided p of the mean of (n,) differences; 1 where all are zero."""
    return largest_mean_p(difference[:, None])


def largest_mean_p(differences: Floats) -> float:
    """Two-sided p of the largest mean of (n, k) differences, k of each unit, whose signs are flipped together.

    1 where all are zero.
    """
    if not np.any(differences):
        return 1.0
    values = round_to_grid(differences)
    least = np.abs(values.sum(axis=0)).max()
    flips_of_units = _sign_flips(len(values))
    extreme = sum(int(np.count_nonzero(np.abs(flips @ values).max(axis=1) >= least)) for flips in flips_of_units)
    if len(values) <= _EXACT_UNITS:
        return extreme / float(2 ** (len(values) - 1))
    return (1 + extreme) / (1 + _DRAWS)  # the observed signs are one of the flips


def sign_flip_max_p(lines: Sequence[Floats]) -> list[float]:
    """p of (n,) differences of several lines over the same units, corrected for their number.

    It is the share of flips, each of a unit in all lines at once, whose largest statistic of any line is at least that
    of the line itself (Westfall and Young 1993, max T). Unlike Holm's correction it can be small with few units.
    """
    values = np.stack(lines, axis=1)
    values = values / np.maximum(np.sqrt(np.sum(values**2, axis=0)), np.finfo(float).tiny)
    least = np.abs(values.sum(axis=0)) * (1.0 - 1e-9)
    largest = np.concatenate([np.abs(flips @ values).max(axis=1) for flips in _sign_flips(len(values))])
    extreme = (largest[:, None] >= least).sum(axis=0)
    exact = len(values) <= _EXACT_UNITS
    p = extreme / 2.0 ** (len(values) - 1) if exact else (1 + extreme) / (1 + _DRAWS)
    return [float(each) if each_least > 0.0 else 1.0 for each, each_least in zip(p, least, strict=True)]


def smallest_possible_p(difference: Floats) -> float:
    """The smallest p that differences of these sizes can have: that of equal signs."""
    return sign_flip_p(np.abs(difference))


def _sign_flips(count: int) -> Iterable[Floats]:
    """All flips or `_DRAWS` of them, as arrays (F, count) of signs -1 and 1."""
    return (_cached_sign_flips(count),) if count <= _MAX_CACHED_UNITS else _drawn_sign_flips(count)


@lru_cache(maxsize=32)
def _cached_sign_flips(count: int) -> Floats:
    """(F, count) signs. Where all are enumerated, the last is never flipped; the other half is symmetric."""
    if count > _EXACT_UNITS:
        return np.concatenate(list(_drawn_sign_flips(count)))
    flips = np.arange(2 ** (count - 1))[:, None] >> np.arange(count) & 1
    return 1.0 - 2.0 * flips.astype(float)


def _drawn_sign_flips(count: int) -> Iterator[Floats]:
    rng = generator(0, "sign flips", count)
    for _ in range(_DRAWS // _DRAWS_AT_ONCE):
        yield 1.0 - 2.0 * rng.integers(0, 2, (_DRAWS_AT_ONCE, count)).astype(float)


def holm(p: Sequence[float]) -> list[float]:
    """Correct p values for their number (Holm 1979): the smallest times n, the next times n - 1, and so on."""
    order = sorted(range(len(p)), key=lambda at: p[at])
    corrected, highest = [0.0] * len(p), 0.0
    for rank, at in enumerate(order):
        highest = max(highest, min(1.0, (len(p) - rank) * p[at]))
        corrected[at] = highest
    return corrected
