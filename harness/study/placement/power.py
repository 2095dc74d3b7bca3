"""Statistical power of a placement study: what its units can show, before its cells run.

Sets are compared by sign flips over units (performers, see `compare.units`), corrected for the number of comparisons.
With n units no p is below 2/2^n, so too few units show nothing, however large the differences. With enough units a
difference must exceed the spread of the paired differences between units. Spread and duration are measured on a few
sets of the study itself, the pilot.

A difference *can be shown* if a study finds it with probability 0.8, where paired differences are normal.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import combinations

import numpy as np
from scipy import special

from harness.compare import SIGNIFICANCE, count_needed
from harness.core.seeds import generator
from harness.results.findings import StatisticalPower
from harness.study.placement.candidates import StationSet
from harness.study.placement.ranking import Costs

POWER = 0.8
"""Probability with which a difference that can be shown is found."""
PILOT_SETS = 4
"""Number of sets that are measured first."""
WORTHWHILE = 0.1
"""A difference of this share of the mean error is worth showing; claims of papers have the same margin."""
_MOST_FLIPPED, _DRAWS = 16, 200
_MOST_UNITS = 1_000_000


def choose_pilot(sets: Sequence[StationSet]) -> list[StationSet]:
    """A few sets, evenly spaced among those of a study."""
    count = min(PILOT_SETS, len(sets))
    return [sets[(2 * at + 1) * len(sets) // (2 * count)] for at in range(count)]


def estimate_power(
    pilot: Mapping[StationSet, Costs],
    *,
    units: int,
    sets: int,
    unit: str,
    cell_s: float | None = None,
    duration_s: Callable[[int], float | None] = lambda units: None,
) -> StatisticalPower:
    """The power of a study with `units` units that compares `sets` sets, from the costs of its pilot.

    `cell_s` is the duration of a cell on one worker [s], and `duration_s` that of the study with so many units [s].
    """
    comparisons = max(sets - 1, 1)
    least = count_needed(comparisons)
    spread, mean = _pooled_spread(list(pilot.values())), _mean(list(pilot.values()))
    shown = wanted = needed = None
    if spread is not None and mean is not None:
        wanted = WORTHWHILE * abs(mean)
        shown = spread * smallest_effect(units, comparisons) if units >= least else None
        needed = units_needed(wanted / spread, comparisons) if spread > 0.0 and wanted > 0.0 else None
    return StatisticalPower(
        clips=units,
        sets=sets,
        unit=unit,
        least_clips=least,
        duration_s=duration_s(units),
        least_duration_s=duration_s(least),
        cell_s=cell_s,
        spread=spread,
        shown=shown,
        wanted=wanted,
        needed_clips=needed,
        needed_duration_s=None if needed is None else duration_s(needed),
        pilot_sets=len(pilot),
    )


def _pooled_spread(pilot: Sequence[Costs]) -> float | None:
    """Root mean square, over pairs of sets, of the standard deviation of the paired differences; None if unknown."""
    variances = []
    for a, b in combinations(pilot, 2):
        both = [(x, y) for unit, x in a.items() if x is not None and (y := b.get(unit)) is not None]
        if len(both) > 1:
            variances.append(np.var([x - y for x, y in both], ddof=1))
    return math.sqrt(float(np.mean(variances))) if variances else None


def _mean(pilot: Sequence[Costs]) -> float | None:
    values = [value for costs in pilot for value in costs.values() if value is not None]
    return float(np.mean(values)) if values else None


@cache
def smallest_effect(units: int, comparisons: int) -> float:
    """Smallest difference, in standard deviations of the paired differences, that `units` units can show.

    It is infinite with fewer than `count_needed` units. With that many, or up to two more, few flips may be more
    extreme, and the test is simulated on fixed draws. With more, the t-test with the same correction differs by 7 % at
    most.
    """
    least, level = count_needed(comparisons), SIGNIFICANCE / comparisons
    if units < least:
        return math.inf
    return _sign_flip_effect(units, level) if units < min(least + 3, _MOST_FLIPPED) else _t_effect(units, level)


def _sign_flip_effect(units: int, level: float) -> float:
    """Quantile `POWER`, over normal samples, of the shift from which a sample is significant.

    A sign flip of the units S gives a sum as large as the observed one exactly if the sum over S is not positive. The
    two-sided p is at most `level` if at most `most` subsets, with the empty one, are such. So the sample z + shift is
    significant from the `most`-th largest of the means of -z over the other subsets on.
    """
    most = int(level * 2.0**units / 2.0)
    rng = generator(0, "placement", "power", str(units))
    subsets = (np.arange(1, 2**units)[:, None] >> np.arange(units) & 1).astype(np.float32)
    size = subsets.sum(axis=1)
    shifts = [
        np.partition(subsets @ -rng.normal(size=units).astype(np.float32) / size, -most)[-most] for _ in range(_DRAWS)
    ]
    return float(np.quantile(shifts, POWER))


def _t_effect(units: int, level: float) -> float:
    """The effect that the two-sided paired t-test finds with probability `POWER`, by shifting its critical value."""
    critical, margin = special.stdtrit(units - 1, [1.0 - level / 2.0, POWER])
    return float((critical + margin) / math.sqrt(units))


@cache
def units_needed(effect: float, comparisons: int) -> int:
    """Least number of units that show a difference of `effect` standard deviations; at most a million."""
    least = count_needed(comparisons)
    for units in range(least, least + 3):
        if smallest_effect(units, comparisons) <= effect:
            return units
    low, high = least + 3, _MOST_UNITS
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if _t_effect(middle, SIGNIFICANCE / comparisons) <= effect else (middle + 1, high)
    return low
