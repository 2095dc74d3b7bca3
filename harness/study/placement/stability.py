"""Stability of a ranking of sets: over behaviours, methods and noise, and over the units that it was made on."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.compare.rank_correlation import compare_orders, tau_b, tau_interval
from harness.compare.significance import SIGNIFICANCE, count_needed, holm, sign_flip_p
from harness.core.arrays import Floats
from harness.results.placement_findings import ChangedOrder, PlacementCondition, RankAgreement, StationNames
from harness.study.placement.ranking import (
    Costs,
    complete_sets,
    join_names,
    mean_cost,
    selection_stability,
    sort_by_cost,
)

_MOST_TESTED_SETS = 24
"""Most sets whose changes of order are tested: the correction for all pairs of more would leave nothing significant."""
_MOST_CHANGES = 10
"""Most changes of order that are kept for two conditions."""


@dataclass(frozen=True)
class ConditionCosts:
    """Costs of the compared sets under one condition."""

    name: str
    kind: str
    costs: Mapping[StationNames, Costs]


def rank_by_condition(
    conditions: Sequence[ConditionCosts], compared: Sequence[StationNames], sign: float
) -> tuple[PlacementCondition, ...]:
    """Rank the sets under each condition; means have the sign of the metric (`sign` -1: high values are good)."""
    ranked = []
    for condition in conditions:
        complete, _ = complete_sets({names: condition.costs.get(names, {}) for names in compared})
        best: dict[str, StationNames] = {}
        for names in reversed(sort_by_cost(complete)):
            best[str(len(names))] = names
        means = tuple(sign * mean_cost(complete[names]) if names in complete else None for names in compared)
        units = len(next(iter(complete.values()), {}))
        stability = selection_stability(complete) if complete else None
        ranked.append(PlacementCondition(condition.name, condition.kind, best, means, units, stability))
    return tuple(ranked)


def rank_agreements(
    conditions: Sequence[ConditionCosts], compared: Sequence[StationNames]
) -> tuple[RankAgreement, ...]:
    """Rank correlation of every two conditions, over the sets that both measured on all their units."""
    agreements = []
    for a, b in itertools.combinations(conditions, 2):
        sides = [complete_sets({names: one.costs.get(names, {}) for names in compared})[0] for one in (a, b)]
        shared = [names for names in compared if all(names in side for side in sides)]
        tables = [np.array([list(side[names].values()) for names in shared]) for side in sides]
        if len(shared) < 2:
            agreements.append(RankAgreement(a.name, b.name, None, len(shared)))
            continue
        tau = float(tau_b(tables[0].mean(axis=1), tables[1].mean(axis=1)))
        pairs = compare_orders(list(map(join_names, shared)), tables, (a.name, b.name)) if np.isfinite(tau) else ()
        low, high = tau_interval(pairs)
        same_units = list(sides[0][shared[0]]) == list(sides[1][shared[0]])
        changes = changed_orders(shared, tables[0], tables[1], paired=same_units)
        agreements.append(
            RankAgreement(
                *(a.name, b.name, tau if np.isfinite(tau) else None, len(shared), low, high),
                changed=tuple(changes[:_MOST_CHANGES]),
                changes=len(changes),
                significant_changes=sum(bool(change.significant) for change in changes),
            )
        )
    return tuple(agreements)


def changed_orders(names: Sequence[StationNames], a: Floats, b: Floats, *, paired: bool) -> list[ChangedOrder]:
    """Pairs of sets in opposite order under two conditions, from (sets, units) costs under each.

    The change of the difference between two sets is tested by sign flips over units, corrected for all pairs of sets
    (Holm). That needs the same units on both sides (`paired`), as many as can show a change among all pairs, and few
    sets; elsewhere `significant` is None. Significant changes come first, then the largest.
    """
    pairs = list(itertools.combinations(range(len(names)), 2))
    corrected: list[float | None] = [None] * len(pairs)
    if paired and a.shape[1] >= count_needed(len(pairs)) and len(names) <= _MOST_TESTED_SETS:
        corrected = list(holm([sign_flip_p((a[i] - a[j]) - (b[i] - b[j])) for i, j in pairs]))
    changes = []
    for (i, j), p in zip(pairs, corrected, strict=True):
        first, second = (i, j) if a[i].mean() < a[j].mean() else (j, i)
        before, after = (float((side[second] - side[first]).mean()) for side in (a, b))
        if before > 0.0 > after:
            significant = None if p is None else p <= SIGNIFICANCE
            changes.append(ChangedOrder(names[first], names[second], (before, after), significant))
    return sorted(changes, key=lambda c: (not c.significant, c.differences[1] - c.differences[0]))
