"""Sets of trackers in order, and how sure the order is.

Errors are costs here: one figure for each clip, the less the better. Sets are compared on the same clips. Ranks are by
the mean; a rank that comparisons leave open is told as a range: with each of the other sets a set is compared by sign
flips over clips, the p corrected for their number (Holm 1979), and those surely better and surely worse bound its rank
(a confidence interval for the rank of each set by itself; Mogstad, Romano, Shaikh and Wilhelm 2024, Inference for ranks
with applications to mobility across neighbourhoods, Rev. Econ. Stud. 91). The set that comes out best of many on some
clips is flattered by them: see `cross_validated_cost`.
"""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from harness.compare.paired_statistics import MIN_CLIPS, bootstrap_interval, compare_paired
from harness.compare.significance import SIGNIFICANCE, holm, sign_flip_p
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.results.placement_findings import (
    BestSet,
    PlacementMode,
    RankedSet,
    Ranking,
    StationNames,
    StationSetResult,
)

Costs = Mapping[str, float | None]
"""Clip -> cost; None where it was not measured."""
_RESAMPLES = 2000


def complete_sets(sets: Mapping[StationNames, Costs]) -> tuple[dict[StationNames, dict[str, float]], list[str]]:
    """The sets that were measured on every clip on which any was, and a line about each of the others."""
    clips = sorted({clip for costs in sets.values() for clip, value in costs.items() if value is not None})
    whole: dict[StationNames, dict[str, float]] = {}
    left_out = []
    for worn, costs in sets.items():
        measured = {clip: value for clip in clips if (value := costs.get(clip)) is not None}
        if clips and len(measured) == len(clips):
            whole[worn] = measured
        else:
            left_out.append(f"not ranked: {'+'.join(worn)} was measured on {len(measured)} of {len(clips)} clips")
    return whole, left_out


def rank_sets(mode: PlacementMode, title: str, sets: Mapping[StationNames, Costs], base: StationNames = ()) -> Ranking:
    """Best first; sets that were not measured on every clip are left out (see `complete_sets`)."""
    whole, _ = complete_sets(sets)
    order = sort_by_cost(whole)
    better, worse = significant_differences(order, whole)
    rows = []
    for at, worn in enumerate(order):
        to_best = compare_paired(whole[worn], whole[order[0]])
        to_last = compare_paired(whole[worn], whole[order[max(at - 1, 0)]])
        rows.append(
            RankedSet(
                stations=worn,
                rank=at + 1,
                rank_low=1 + len(better[at]),
                rank_high=len(order) - len(worse[at]),
                difference=to_best.mean,
                low=to_best.low,
                high=to_best.high,
                tied=0 not in better[at],
                step=to_last.mean,
                step_low=to_last.low,
                step_high=to_last.high,
            )
        )
    return Ranking(mode, title, tuple(rows), base)


def sort_by_cost(whole: Mapping[StationNames, Mapping[str, float]]) -> list[StationNames]:
    """By mean cost; equal ones by name, so that the order is always the same."""
    return sorted(whole, key=lambda worn: (mean_cost(whole[worn]), worn))


def mean_cost(costs: Mapping[str, float]) -> float:
    return math.fsum(costs.values()) / len(costs)


def significant_differences(
    order: Sequence[StationNames], whole: Mapping[StationNames, Mapping[str, float]]
) -> tuple[list[set[int]], list[set[int]]]:
    """For each set the places in the order of those that are surely better, and surely worse."""
    values = _cost_matrix(order, whole)
    count = len(order)
    p = np.ones((count, count))
    for a in range(count):
        for b in range(a):
            p[a, b] = p[b, a] = sign_flip_p(values[a] - values[b])
    better: list[set[int]] = [set() for _ in order]
    worse: list[set[int]] = [set() for _ in order]
    for a in range(count):
        others = [b for b in range(count) if b != a]
        for b, corrected in zip(others, holm([float(p[a, b]) for b in others]), strict=True):
            if corrected <= SIGNIFICANCE:
                (better if b < a else worse)[a].add(b)
    return better, worse


def _cost_matrix(order: Sequence[StationNames], whole: Mapping[StationNames, Mapping[str, float]]) -> Floats:
    """(sets, clips)"""
    clips = sorted(whole[order[0]]) if order else []
    return np.array([[whole[worn][clip] for clip in clips] for worn in order]).reshape(len(order), len(clips))


def min_clips(comparisons: int) -> int:
    """So many clips at least before any of so many comparisons can be surely one way: 2 of 2^n flips are as extreme."""
    return max(MIN_CLIPS, math.ceil(1 + math.log2(max(comparisons, 1) / SIGNIFICANCE)))


def summarise_set(worn: StationNames, rate_hz: float, errors: Costs) -> StationSetResult:
    """With the interval of the mean where clips suffice."""
    measured = {clip: value for clip, value in errors.items() if value is not None}
    low, high = bootstrap_interval(np.array(list(measured.values()))) if len(measured) >= MIN_CLIPS else (None, None)
    return StationSetResult(worn, rate_hz, dict(errors), mean_cost(measured) if measured else None, low, high)


def best_by_size(sets: Mapping[StationNames, Costs], sign: float = 1.0) -> tuple[BestSet, ...]:
    """For each number of stations the best set, its ties, and whether it is on the front of cost and number.

    `sign` -1 tells costs as the metric has them, where high values are good.
    """
    found: list[BestSet] = []
    least = math.inf
    for size in sorted({len(worn) for worn in sets}):
        alike, _ = complete_sets({worn: costs for worn, costs in sets.items() if len(worn) == size})
        if not alike:
            continue
        rows = rank_sets("exhaustive", "", alike).rows
        best, ties = rows[0].stations, tuple(row.stations for row in rows[1:] if row.tied)
        cost = mean_cost(alike[best])
        judged = sign * cross_validated_cost(alike) if len(next(iter(alike.values()))) > 1 else None
        found.append(BestSet(best, ties, cost < least, of=len(alike), stays=selection_stability(alike), crossed=judged))
        least = min(least, cost)
    return tuple(found)


def cross_validated_cost(whole: Mapping[StationNames, Mapping[str, float]]) -> float:
    """Mean cost on each clip of the set that the other clips would have chosen: a choice judged where it was not made.

    Above the mean of the best set by what choosing flatters it (leave-one-out cross-validation).
    """
    order = sorted(whole)
    values = _cost_matrix(order, whole)
    others = values.sum(axis=1, keepdims=True) - values
    return float(np.mean(values[np.argmin(others, axis=0), np.arange(values.shape[1])]))


def selection_stability(whole: Mapping[StationNames, Mapping[str, float]]) -> float:
    """Share of resamples of the clips in which the best set is still the best."""
    order = sort_by_cost(whole)
    values = _cost_matrix(order, whole)
    draws = generator(0, "placement", "stays").integers(0, values.shape[1], (_RESAMPLES, values.shape[1]))
    return float(np.mean(np.argmin(values[:, draws].mean(axis=2), axis=0) == 0))


def join_names(worn: Iterable[str]) -> str:
    """Such as "right_hand+pelvis"."""
    return "+".join(worn) or "none"
