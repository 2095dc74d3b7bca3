"""The answer to a question: sizes compared on held-out units, the advised set, and what a second method says."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from typing import Literal

import numpy as np

from harness.compare import MIN_UNITS, SIGNIFICANCE, compare_paired, decide_verdicts, holm, mean_interval, sign_flip_p
from harness.results.findings import StationNames
from harness.results.findings.advice import PlacementAdvice, SecondChoice, SetError, SizeStep
from harness.study.placement.halving import Price, Race
from harness.study.placement.ranking import Costs, complete_sets, mean_cost, sort_by_cost

_LARGER_IS: Mapping[str, Literal["better", "worse"]] = {"worse": "better", "better": "worse"}
"""Verdict on a rise of the smaller set's error over the larger one's -> that of the larger set."""


def compare_levels(levels: Sequence[StationNames], held_out: Mapping[StationNames, Costs]) -> tuple[SizeStep, ...]:
    """Each two of some sets, the smaller (or cheaper) one first, compared on the held-out units."""
    pairs = list(itertools.combinations(levels, 2))
    gains = [compare_paired(held_out.get(smaller, {}), held_out.get(larger, {})) for smaller, larger in pairs]
    lines = [
        np.array([held_out[smaller][unit] for unit in gain.units], float)
        - np.array([held_out[larger][unit] for unit in gain.units], float)
        for (smaller, larger), gain in zip(pairs, gains, strict=True)
    ]
    verdicts = decide_verdicts(lines, [0.0] * len(lines))
    return tuple(
        SizeStep(
            *(smaller, larger, gain.mean, gain.low, gain.high, result.p_holm, len(gain.units)),
            verdict=_LARGER_IS.get(result.verdict, "cannot tell"),
        )
        for (smaller, larger), gain, result in zip(pairs, gains, verdicts, strict=True)
    )


def advise(
    levels: Sequence[StationNames],
    steps: Sequence[SizeStep],
    errors: Mapping[StationNames, SetError],
    races: Mapping[int, Race],
) -> PlacementAdvice | None:
    """The first of the sets, the smaller (or cheaper) ones first, than which no later one is better.

    A set that errs more than a smaller one is left out, too: a larger set must not be advised for a larger error.
    """
    if not levels:
        return None
    beaten = {step.smaller for step in steps if step.verdict == "better"}
    mean = [np.inf if (error := errors[stations].error) is None else error for stations in levels]
    possible = [at for at in range(len(levels)) if mean[at] <= min(mean[: at + 1])]
    at = next(at for at in possible if levels[at] not in beaten)
    stations, last = levels[at], len(levels) - 1
    own = races[len(stations)]
    ties = own.ties if stations == own.best else ()
    why: Literal["only", "smallest", "between", "largest"]
    why = "only" if not last else "smallest" if at == 0 else "largest" if at == last else "between"
    return PlacementAdvice(errors[stations], why, ties, len(own.sets))


def find_front(races: Sequence[Race], price: Price) -> list[StationNames]:
    """The Pareto front of cost and error among the sets that were not left out, the cheapest set first.

    Errors are compared on the units on which all of them were measured.
    """
    complete, _ = complete_sets({names: costs for race in races for names, costs in _common(races, race).items()})
    front: list[StationNames] = []
    for names in sorted(complete, key=lambda names: (price(names), mean_cost(complete[names]), names)):
        if not front or mean_cost(complete[names]) < mean_cost(complete[front[-1]]):
            front.append(names)
    return front


def _common(races: Sequence[Race], race: Race) -> dict[StationNames, dict[str, float]]:
    """Costs of the finalists of a race on the units of the race that ended first."""
    shared = set.intersection(*({unit for costs in one.finalists.values() for unit in costs} for one in races))
    return {names: {unit: costs[unit] for unit in shared} for names, costs in race.finalists.items()}


def set_error(stations: StationNames, errors: Costs, cost: float | None = None) -> SetError:
    """The mean error of a set on held-out units, with its interval; nothing where a unit was not measured."""
    values = np.array([value for value in errors.values() if value is not None])
    if not len(values) or len(values) < len(errors):
        return SetError(stations, cost=cost)
    low, high = mean_interval(values) if len(values) >= MIN_UNITS else (None, None)
    return SetError(stations, float(values.mean()), low, high, len(values), cost)


def compare_second(
    chosen: StationNames, costs: Mapping[StationNames, Costs], ties: Collection[StationNames] = ()
) -> SecondChoice | None:
    """What the costs of some sets under a second method say of the chosen one; None where it was not measured.

    `ties` are the sets that are tied with the chosen one under the first method.
    """
    complete, _ = complete_sets(costs)
    if chosen not in complete:
        return None
    order = sort_by_cost(complete)
    if order[0] == chosen:
        return SecondChoice(chosen, chosen, 0.0, of=len(order), units=len(complete[chosen]))
    gap, worse = compare_paired(complete[chosen], complete[order[0]]), _is_beaten(chosen, complete)
    better = order[: order.index(chosen)] if worse else []
    shared = next((SetError(names) for names in better if names in ties and not _is_beaten(names, complete)), None)
    return SecondChoice(
        *(chosen, order[0], gap.mean, gap.low, gap.high, worse, len(order), len(complete[chosen])), shared=shared
    )


def _is_beaten(names: StationNames, costs: Mapping[StationNames, Mapping[str, float]]) -> bool:
    """Whether a set is significantly worse than another one: sign flips over units, corrected for all others (Holm)."""
    own, others = costs[names], [costs[other] for other in costs if other != names]
    p = holm([sign_flip_p(np.array([own[unit] - other[unit] for unit in own])) for other in others])
    lows = [compare_paired(own, other).low or 0.0 for other in others]
    return any(corrected <= SIGNIFICANCE and low > 0.0 for corrected, low in zip(p, lows, strict=True))
