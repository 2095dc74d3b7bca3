"""Equivalence of the two sides in one metric, by two one-sided tests (Schuirmann 1987) over units.

Simulation and device are equivalent at the level a if the interval of the level 1 - 2a of their mean difference lies
within the margin. Equivalence of several arms is claimed only if each is shown, so that no correction is needed
(intersection-union, Berger 1982).
"""

from collections.abc import Mapping

import numpy as np

from harness.compare.paired_statistics import MIN_UNITS, mean_interval
from harness.compare.ranking import shared_clips
from harness.results.trust_findings import Equivalence, EquivalenceVerdict


def judge_equivalence(
    arm: str, metric: str, device: Mapping[str, float], simulated: Mapping[str, float], margin: float, level: float
) -> Equivalence:
    """Judge one metric of one arm; `device` and `simulated` map units to errors, and units of both sides count.

    *Equivalent*: the whole interval lies within the margin. *Beyond the margin*: it lies outside as a whole. Anything
    else, and fewer than `MIN_UNITS` units, is undecided.
    """
    units = shared_clips((device, simulated))
    if not units:
        return Equivalence(arm, metric, margin, 0, None, None, None, None, None, "cannot tell", "no unit on both sides")
    sides = [np.array([side[unit] for unit in units]) for side in (device, simulated)]
    difference = sides[1] - sides[0]
    means = float(sides[0].mean()), float(sides[1].mean()), float(difference.mean())
    if len(units) < MIN_UNITS:
        why = f"too few units: {len(units)}, of at least {MIN_UNITS}"
        return Equivalence(arm, metric, margin, len(units), *means, None, None, "cannot tell", why)
    low, high = mean_interval(difference, 1.0 - 2.0 * level)
    verdict: EquivalenceVerdict = "cannot tell"
    why = "the interval contains an end of the margin"
    if -margin <= low and high <= margin:
        verdict, why = "equivalent", "the whole interval lies within the margin"
    elif low > margin or high < -margin:
        verdict, why = "beyond the margin", "the whole interval lies beyond the margin"
    return Equivalence(arm, metric, margin, len(units), *means, low, high, verdict, why)
