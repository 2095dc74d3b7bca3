"""Ranking of station sets by errors, and what published claims say of the sets."""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.compare import (
    MIN_UNITS,
    SIGNIFICANCE,
    compare_orders,
    compare_paired,
    count_needed,
    holm,
    mean_interval,
    sign_flip_p,
    tau_b,
    tau_interval,
)
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.results.findings import (
    BenchmarkStatement,
    BestSet,
    ChangedOrder,
    PlacementCondition,
    PlacementMode,
    RankAgreement,
    RankedSet,
    Ranking,
    StationNames,
    StationSetResult,
)
from harness.study.papers.claims import claim_lower_error
from harness.study.placement.candidates import CandidateGroup, StationSet, select_groups, station_set
from harness.study.placement.config import PublishedClaim

Costs = Mapping[str, float | None]
"""Unit of statistics -> cost (see `compare.units`); None where it was not measured."""
Measure = Callable[[Sequence[StationSet]], Mapping[StationSet, Costs]]
"""Measures sets: set -> unit of statistics -> cost."""
_RESAMPLES = 2000
_MOST_TESTED_SETS = 24
"""Most sets whose changes of order are tested: the correction for all pairs of more would leave nothing significant."""
_MOST_CHANGES = 10
"""Most changes of order that are kept for two conditions."""


def complete_sets(sets: Mapping[StationNames, Costs]) -> tuple[dict[StationNames, dict[str, float]], list[str]]:
    """Sets that were measured on every unit on which any was; and a sentence about each of the others."""
    units = sorted({unit for costs in sets.values() for unit, value in costs.items() if value is not None})
    complete: dict[StationNames, dict[str, float]] = {}
    left_out = []
    for names, costs in sets.items():
        measured = {unit: value for unit in units if (value := costs.get(unit)) is not None}
        if units and len(measured) == len(units):
            complete[names] = measured
        else:
            left_out.append(f"not ranked: {'+'.join(names)} was measured on {len(measured)} of {len(units)} units")
    return complete, left_out


def rank_sets(mode: PlacementMode, title: str, sets: Mapping[StationNames, Costs], base: StationNames = ()) -> Ranking:
    """Rank sets, best first; sets that were not measured on every unit are left out (see `complete_sets`)."""
    complete, _ = complete_sets(sets)
    order = sort_by_cost(complete)
    better, worse = significant_differences(order, complete)
    rows = []
    for at, names in enumerate(order):
        to_best = compare_paired(complete[names], complete[order[0]])
        to_previous = compare_paired(complete[names], complete[order[max(at - 1, 0)]])
        rows.append(
            RankedSet(
                stations=names,
                rank=at + 1,
                rank_low=1 + len(better[at]),
                rank_high=len(order) - len(worse[at]),
                difference=to_best.mean,
                low=to_best.low,
                high=to_best.high,
                tied=0 not in better[at],
                step=to_previous.mean,
                step_low=to_previous.low,
                step_high=to_previous.high,
            )
        )
    return Ranking(mode, title, tuple(rows), base)


def sort_by_cost(costs: Mapping[StationNames, Mapping[str, float]]) -> list[StationNames]:
    """Sort sets by mean cost; ties by name, so that the order is deterministic."""
    return sorted(costs, key=lambda names: (mean_cost(costs[names]), names))


def mean_cost(costs: Mapping[str, float]) -> float:
    """Mean over units."""
    return math.fsum(costs.values()) / len(costs)


def significant_differences(
    order: Sequence[StationNames], costs: Mapping[StationNames, Mapping[str, float]]
) -> tuple[list[set[int]], list[set[int]]]:
    """For each set, the indices in `order` of the sets that are significantly better, and of those that are worse."""
    values = _cost_matrix(order, costs)
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


def _cost_matrix(order: Sequence[StationNames], costs: Mapping[StationNames, Mapping[str, float]]) -> Floats:
    """(sets, units)"""
    units = sorted(costs[order[0]]) if order else []
    return np.array([[costs[names][unit] for unit in units] for names in order]).reshape(len(order), len(units))


def summarise_set(names: StationNames, rate_hz: float, errors: Costs) -> StationSetResult:
    """Summarise a set, with the interval of the mean where there are enough units."""
    measured = {unit: value for unit, value in errors.items() if value is not None}
    low, high = mean_interval(np.array(list(measured.values()))) if len(measured) >= MIN_UNITS else (None, None)
    return StationSetResult(names, rate_hz, dict(errors), mean_cost(measured) if measured else None, low, high)


def best_by_size(sets: Mapping[StationNames, Costs], sign: float = 1.0) -> tuple[BestSet, ...]:
    """For each number of stations: the best set, its ties, and whether it is on the Pareto front of cost and number.

    `sign` -1 converts costs to values of a metric for which high values are good.
    """
    best_sets: list[BestSet] = []
    least = math.inf
    for size in sorted({len(names) for names in sets}):
        same_size, _ = complete_sets({names: costs for names, costs in sets.items() if len(names) == size})
        if not same_size:
            continue
        rows = rank_sets("exhaustive", "", same_size).rows
        best, ties = rows[0].stations, tuple(row.stations for row in rows[1:] if row.tied)
        cost = mean_cost(same_size[best])
        error = sign * cross_validated_cost(same_size) if len(next(iter(same_size.values()))) > 1 else None
        best_sets.append(
            BestSet(best, ties, cost < least, len(same_size), selection_stability(same_size), error),
        )
        least = min(least, cost)
    return tuple(best_sets)


def cross_validated_cost(costs: Mapping[StationNames, Mapping[str, float]]) -> float:
    """Leave-one-out cross-validated cost: the mean over units of the cost of the set that the other units choose.

    It exceeds the mean of the best set by the bias of choosing that set on the same units.
    """
    order = sorted(costs)
    values = _cost_matrix(order, costs)
    others = values.sum(axis=1, keepdims=True) - values
    return float(np.mean(values[np.argmin(others, axis=0), np.arange(values.shape[1])]))


def selection_stability(costs: Mapping[StationNames, Mapping[str, float]]) -> float:
    """Share of resamples of the units in which the best set remains the best."""
    order = sort_by_cost(costs)
    values = _cost_matrix(order, costs)
    draws = generator(0, "placement", "stays").integers(0, values.shape[1], (_RESAMPLES, values.shape[1]))
    return float(np.mean(np.argmin(values[:, draws].mean(axis=2), axis=0) == 0))


def join_names(names: Iterable[str]) -> str:
    """Join names, such as "right_hand+pelvis"; "none" without names."""
    return "+".join(names) or "none"


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


def sets_of_claim(
    claim: PublishedClaim, units: Sequence[CandidateGroup]
) -> tuple[StationSet, list[StationSet], StationSet]:
    """The claimed set, the other sets of the same size, and the set of all of the paper's stations."""
    where = f"the claim {claim.text!r}"
    groups = select_groups(claim.among, units, where)
    claimed, full = station_set(select_groups(claim.set, units, where), units), station_set(groups, units)
    same_size = [
        station_set(combination, units)
        for n in range(1, len(claimed) + 1)
        for combination in itertools.combinations(groups, n)
        if sum(map(len, combination)) == len(claimed)
    ]
    return claimed, [stations for stations in same_size if stations != claimed], full


def best_alternative(others: Sequence[StationNames], costs: Mapping[StationNames, Costs]) -> StationNames:
    """The set with the least cost; () if none was measured."""
    complete, _ = complete_sets({names: costs[names] for names in others})
    return next(iter(sort_by_cost(complete)), ())


def evaluate_claim(
    claim: PublishedClaim,
    claimed: StationNames,
    other: StationNames,
    full: StationNames,
    costs: Mapping[StationNames, Costs],
    *,
    unit: str,
    basis: str,
) -> tuple[BenchmarkStatement, BenchmarkStatement]:
    """Evaluate both claims by costs of the units of the test clips, which `basis` describes in words."""
    measured = {
        names: {name: value for name, value in costs.get(names, {}).items() if value is not None}
        for names in (claimed, other, full)
    }
    allowed = {name: (1.0 + claim.margin) * value for name, value in measured[full].items()}
    best_of_size = f"{claim.text}: no other {len(claimed)} stations err less (against the best, {join_names(other)})"
    within = f"{claim.text}: {join_names(claimed)} err at most {claim.margin:.0%} more than all {len(full)}"
    published = f"stated by {claim.source}"
    why = "; ".join(filter(None, (claim.why_not, basis)))
    suffices = claim_lower_error(within, measured[claimed], allowed, published=published, unit=unit, why=why)
    if suffices.verdict != "not run":
        shared = measured[claimed].keys() & measured[full].keys()
        mean, mean_of_all = (mean_cost({name: measured[names][name] for name in shared}) for names in (claimed, full))
        limit = f"limit {(1.0 + claim.margin) * mean_of_all:.2f} {unit}, {1.0 + claim.margin:.0%} of {mean_of_all:.2f}"
        suffices = replace(suffices, measured=f"{mean:.2f} {unit}; {limit} of all {len(full)}")
    return (
        claim_lower_error(best_of_size, measured[claimed], measured[other], published=published, unit=unit, why=why),
        suffices,
    )
