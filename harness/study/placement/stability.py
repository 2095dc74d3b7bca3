"""How stable a ranking of sets is: over behaviours, methods and noise, and over the clips that it was made on."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.compare.paired_statistics import CONFIDENCE_LEVEL, MIN_CLIPS
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.results.placement_findings import PlacementCondition, RankAgreement, StationNames
from harness.study.placement.ranking import Costs, complete_sets, mean_cost, selection_stability, sort_by_cost

_RESAMPLES = 2000


@dataclass(frozen=True)
class ConditionCosts:
    """What the compared sets cost under one condition."""

    name: str
    kind: str
    costs: Mapping[StationNames, Costs]


def rank_by_condition(
    each: Sequence[ConditionCosts], compared: Sequence[StationNames], sign: float
) -> tuple[PlacementCondition, ...]:
    """Which set is best there; means are told as the metric has them (`sign` -1: high values are good)."""
    found = []
    for one in each:
        whole, _ = complete_sets({worn: one.costs.get(worn, {}) for worn in compared})
        best: dict[str, StationNames] = {}
        for worn in reversed(sort_by_cost(whole)):
            best[str(len(worn))] = worn
        means = tuple(sign * mean_cost(whole[worn]) if worn in whole else None for worn in compared)
        clips = len(next(iter(whole.values()), {}))
        found.append(
            PlacementCondition(one.name, one.kind, best, means, clips, selection_stability(whole) if whole else None)
        )
    return tuple(found)


def rank_agreements(each: Sequence[ConditionCosts], compared: Sequence[StationNames]) -> tuple[RankAgreement, ...]:
    """Of every two conditions, over the sets that both measured on all their clips."""
    found = []
    for a, b in itertools.combinations(each, 2):
        sides = [complete_sets({worn: one.costs.get(worn, {}) for worn in compared})[0] for one in (a, b)]
        shared = [worn for worn in compared if all(worn in side for side in sides)]
        tables = [np.array([list(side[worn].values()) for worn in shared]) for side in sides]
        if len(shared) < 2:
            found.append(RankAgreement(a.name, b.name, None, len(shared)))
            continue
        same_clips = list(sides[0][shared[0]]) == list(sides[1][shared[0]])
        low, high = _interval(tables, same_clips)
        tau = float(tau_b(tables[0].mean(axis=1), tables[1].mean(axis=1)))
        found.append(RankAgreement(a.name, b.name, tau if np.isfinite(tau) else None, len(shared), low, high))
    return tuple(found)


def tau_b(a: Floats, b: Floats) -> Floats:
    """Kendall's tau-b of (..., n) and (..., n) values, over the last axis; NaN where one side has all alike."""
    first, second = np.triu_indices(a.shape[-1], 1)
    up_a, up_b = (np.sign(side[..., first] - side[..., second]) for side in (a, b))
    with np.errstate(invalid="ignore"):
        out: Floats = np.sum(up_a * up_b, axis=-1) / np.sqrt(np.sum(up_a**2, axis=-1) * np.sum(up_b**2, axis=-1))
    return out


def _interval(tables: Sequence[Floats], same_clips: bool) -> tuple[float | None, float | None]:
    """Percentiles over resamples of the clips; the same draw for both sides where they are judged on the same clips."""
    counts = [table.shape[1] for table in tables]
    if min(counts) < MIN_CLIPS:
        return None, None
    rng = generator(0, "placement", "tau")
    first = rng.integers(0, counts[0], (_RESAMPLES, counts[0]))
    second = first if same_clips else rng.integers(0, counts[1], (_RESAMPLES, counts[1]))
    found = tau_b(*(table[:, draws].mean(axis=2).T for table, draws in zip(tables, (first, second), strict=True)))
    if np.isnan(found).all():
        return None, None
    low, high = np.nanquantile(found, [(1.0 - CONFIDENCE_LEVEL) / 2.0, (1.0 + CONFIDENCE_LEVEL) / 2.0])
    return float(low), float(high)
