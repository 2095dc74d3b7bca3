"""Statistical power of a placement study: what its clips can show, before its cells run.

Sets are compared by sign flips over clips, corrected for the number of comparisons. With n clips no p is below 2/2^n,
so too few clips show nothing, however large the differences. With enough clips a difference must exceed the spread of
the paired differences between clips. Spread and duration are measured on a few sets of the study itself, the pilot.

A difference *can be shown* if a study finds it with probability 0.8, where paired differences are normal.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import combinations

import numpy as np
from scipy import special

from harness.compare.significance import SIGNIFICANCE, count_needed
from harness.core.seeds import generator
from harness.results.placement_findings import StatisticalPower
from harness.study.placement.candidates import StationSet
from harness.study.placement.ranking import Costs

POWER = 0.8
"""Probability with which a difference that can be shown is found."""
PILOT_SETS = 4
"""Number of sets that are measured first."""
WORTHWHILE = 0.1
"""A difference of this share of the mean error is worth showing; claims of papers have the same margin."""
_MOST_FLIPPED, _DRAWS = 16, 200
_MOST_CLIPS = 1_000_000


def choose_pilot(sets: Sequence[StationSet]) -> list[StationSet]:
    """A few sets, evenly spaced among those of a study."""
    count = min(PILOT_SETS, len(sets))
    return [sets[(2 * at + 1) * len(sets) // (2 * count)] for at in range(count)]


def estimate_power(
    pilot: Mapping[StationSet, Costs],
    *,
    clips: int,
    sets: int,
    unit: str,
    cell_s: float | None,
    duration_s: Callable[[int], float | None],
) -> StatisticalPower:
    """The power of a study with `clips` clips that compares `sets` sets, from the costs of its pilot.

    `cell_s` is the duration of a cell on one worker [s], and `duration_s` that of the study with so many clips [s].
    """
    comparisons = max(sets - 1, 1)
    least = count_needed(comparisons)
    spread, mean = _pooled_spread(list(pilot.values())), _mean(list(pilot.values()))
    shown = wanted = needed = None
    if spread is not None and mean is not None:
        wanted = WORTHWHILE * abs(mean)
        shown = spread * smallest_effect(clips, comparisons) if clips >= least else None
        needed = clips_needed(wanted / spread, comparisons) if spread > 0.0 and wanted > 0.0 else None
    return StatisticalPower(
        clips=clips,
        sets=sets,
        unit=unit,
        least_clips=least,
        duration_s=duration_s(clips),
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
        both = [(x, y) for clip, x in a.items() if x is not None and (y := b.get(clip)) is not None]
        if len(both) > 1:
            variances.append(np.var([x - y for x, y in both], ddof=1))
    return math.sqrt(float(np.mean(variances))) if variances else None


def _mean(pilot: Sequence[Costs]) -> float | None:
    values = [value for costs in pilot for value in costs.values() if value is not None]
    return float(np.mean(values)) if values else None


@cache
def smallest_effect(clips: int, comparisons: int) -> float:
    """Smallest difference, in standard deviations of the paired differences, that `clips` clips can show.

    It is infinite with fewer than `count_needed` clips. With that many, or up to two more, few flips may be more
    extreme, and the test is simulated on fixed draws. With more, the t-test with the same correction differs by 7 % at
    most.
    """
    least, level = count_needed(comparisons), SIGNIFICANCE / comparisons
    if clips < least:
        return math.inf
    return _sign_flip_effect(clips, level) if clips < min(least + 3, _MOST_FLIPPED) else _t_effect(clips, level)


def _sign_flip_effect(clips: int, level: float) -> float:
    """Quantile `POWER`, over normal samples, of the shift from which a sample is significant.

    A sign flip of the clips S gives a sum as large as the observed one exactly if the sum over S is not positive. The
    two-sided p is at most `level` if at most `most` subsets, with the empty one, are such. So the sample z + shift is
    significant from the `most`-th largest of the means of -z over the other subsets on.
    """
    most = int(level * 2.0**clips / 2.0)
    rng = generator(0, "placement", "power", str(clips))
    subsets = (np.arange(1, 2**clips)[:, None] >> np.arange(clips) & 1).astype(np.float32)
    size = subsets.sum(axis=1)
    shifts = [
        np.partition(subsets @ -rng.normal(size=clips).astype(np.float32) / size, -most)[-most] for _ in range(_DRAWS)
    ]
    return float(np.quantile(shifts, POWER))


def _t_effect(clips: int, level: float) -> float:
    """The effect that the two-sided paired t-test finds with probability `POWER`, by shifting its critical value."""
    critical, margin = special.stdtrit(clips - 1, [1.0 - level / 2.0, POWER])
    return float((critical + margin) / math.sqrt(clips))


@cache
def clips_needed(effect: float, comparisons: int) -> int:
    """Least number of clips that show a difference of `effect` standard deviations; at most a million."""
    least = count_needed(comparisons)
    for clips in range(least, least + 3):
        if smallest_effect(clips, comparisons) <= effect:
            return clips
    low, high = least + 3, _MOST_CLIPS
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if _t_effect(middle, SIGNIFICANCE / comparisons) <= effect else (middle + 1, high)
    return low
