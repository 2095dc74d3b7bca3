"""Kendall's rank correlation of two sides, and its interval from the pairs of items whose order both sides show.

A pair is decided where both sides show a difference in the direction of their means. The p of a pair is the larger of
two one-sided p values, and Holm's method corrects it for the number of pairs. Where a contradiction is false, one of
two opposite signs is wrong.

The interval of tau follows from the decided pairs. Every other pair may be in the same or in the opposite order. Holm's
correction makes all decisions true at once with a probability of 95 %, and tau then lies in the interval (simultaneous
inference for ranks, as Klein, Wright and Wieczorek 2020). Percentiles of tau over resampled units are no such interval:
resampling exchanges items that are nearly equal, which biases tau towards zero.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy import special

from harness.compare.paired_statistics import MIN_UNITS
from harness.compare.significance import SIGNIFICANCE, holm
from harness.core.arrays import Floats
from harness.results.findings import PairAgreement, PairVerdict, SideDifference


def tau_b(a: Floats, b: Floats) -> Floats:
    """Kendall's tau-b of (..., n) and (..., n) values, over the last axis; NaN where one side has only ties."""
    first, second = np.triu_indices(a.shape[-1], 1)
    sign_a, sign_b = (np.sign(side[..., first] - side[..., second]) for side in (a, b))
    with np.errstate(invalid="ignore"):
        out: Floats = np.sum(sign_a * sign_b, axis=-1) / np.sqrt(
            np.sum(sign_a**2, axis=-1) * np.sum(sign_b**2, axis=-1)
        )
    return out


def compare_orders(
    items: Sequence[str], tables: Sequence[Floats], sides: tuple[str, str], unit: str = "units"
) -> list[PairAgreement]:
    """Decide on all pairs of items from (items, units) errors on each of two sides, which may have other units."""
    pairs = list(combinations(range(len(items)), 2))
    compared = [
        (min(table.shape[1] for table in tables), (_difference(tables[0], *pair), _difference(tables[1], *pair)))
        for pair in pairs
    ]
    return decide_pairs([(items[a], items[b]) for a, b in pairs], compared, SIGNIFICANCE, sides=sides, unit=unit)


def _difference(table: Floats, a: int, b: int) -> SideDifference:
    values = table[a] - table[b]
    if len(values) < MIN_UNITS:
        return SideDifference(float(values.mean()) if len(values) else None, None, None, None)
    return side_difference(values, float(values.var(ddof=1)), len(values) - 1, SIGNIFICANCE / 2.0)


def tau_interval(pairs: Sequence[PairAgreement]) -> tuple[float | None, float | None]:
    """The smallest and the largest tau that the decided pairs allow; None where no pair was tested for few units."""
    if not any(pair.p is not None for pair in pairs):
        return None, None
    verdicts = [pair.verdict for pair in pairs]
    decided, undecided = verdicts.count("agree") - verdicts.count("contradict"), verdicts.count("cannot tell")
    return (decided - undecided) / len(pairs), (decided + undecided) / len(pairs)


def decide_pairs(
    pairs: Sequence[tuple[str, str]],
    compared: Sequence[tuple[int, tuple[SideDifference, SideDifference]]],
    level: float,
    *,
    sides: tuple[str, str] = ("device", "simulation"),
    unit: str = "units",
) -> list[PairAgreement]:
    """Decide on pairs that are tested together, from their numbers of units and the differences of both sides.

    `sides` and `unit` name the two sides and what was counted in the reasons.
    """
    tested = [at for at, (_, found) in enumerate(compared) if all(side.p is not None for side in found)]
    p = {at: max(side.p or 0.0 for side in compared[at][1]) for at in tested}
    corrected = dict(zip(tested, holm([p[at] for at in tested]), strict=True))
    judged = []
    for at, ((a, b), (count, found)) in enumerate(zip(pairs, compared, strict=True)):
        if at in corrected:
            verdict, why = _verdict(dict(zip(sides, found, strict=True)), corrected[at], level, len(tested))
        else:
            verdict, why = "cannot tell", f"too few {unit}: {count}, of at least {MIN_UNITS}"
        judged.append(PairAgreement(a, b, count, *found, p.get(at), corrected.get(at), verdict, why))
    return judged


def _verdict(sides: Mapping[str, SideDifference], p_holm: float, level: float, pairs: int) -> tuple[PairVerdict, str]:
    first, second = (np.sign(side.mean or 0.0) for side in sides.values())
    if p_holm <= level:
        if first == second:
            return "agree", "both sides show the same order"
        return "contradict", "each side shows the other order"
    weak = [name for name, side in sides.items() if side.p is not None and side.p > level]
    if weak:
        return "cannot tell", f"no significant difference on the {' and the '.join(weak)}"
    return "cannot tell", f"not significant among {pairs} pairs"


def side_difference(values: Floats, variance: float, free: int, level: float) -> SideDifference:
    """The mean of (n,) differences, whose noise has this variance, known with `free` degrees of freedom."""
    mean, deviation = float(values.mean()), float(np.sqrt(variance / len(values)))
    half = float(special.stdtrit(free, 1.0 - level)) * deviation
    p = 0.0 if mean else 1.0
    if deviation > 0.0:
        p = float(special.stdtr(free, -abs(mean) / deviation))
    return SideDifference(mean, mean - half, mean + half, p)
