"""How stable a ranking of sets is: over behaviours, methods and noise, and over the clips that it was made on."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.score.paired import FEWEST_CLIPS, LEVEL
from harness.score.placement import Agreement, Condition, Stations
from harness.study.ranking import Costs, complete, in_order, mean, stays

_RESAMPLES = 500


@dataclass(frozen=True)
class Elsewhere:
    """What the compared sets cost under one condition."""

    name: str
    kind: str
    costs: Mapping[Stations, Costs]


def conditions(each: Sequence[Elsewhere], compared: Sequence[Stations], sign: float) -> tuple[Condition, ...]:
    """Which set is best there; means are told as the metric has them (`sign` -1: high values are good)."""
    found = []
    for one in each:
        whole, _ = complete({worn: one.costs.get(worn, {}) for worn in compared})
        best: dict[str, Stations] = {}
        for worn in reversed(in_order(whole)):
            best[str(len(worn))] = worn
        means = tuple(sign * mean(whole[worn]) if worn in whole else None for worn in compared)
        clips = len(next(iter(whole.values()), {}))
        found.append(Condition(one.name, one.kind, best, means, clips, stays(whole) if whole else None))
    return tuple(found)


def agreements(each: Sequence[Elsewhere], compared: Sequence[Stations]) -> tuple[Agreement, ...]:
    """Of every two conditions, over the sets that both measured on all their clips."""
    found = []
    for a, b in itertools.combinations(each, 2):
        sides = [complete({worn: one.costs.get(worn, {}) for worn in compared})[0] for one in (a, b)]
        shared = [worn for worn in compared if all(worn in side for side in sides)]
        tables = [np.array([list(side[worn].values()) for worn in shared]) for side in sides]
        if len(shared) < 2:
            found.append(Agreement(a.name, b.name, None, len(shared)))
            continue
        same_clips = list(sides[0][shared[0]]) == list(sides[1][shared[0]])
        low, high = _interval(tables, same_clips)
        tau = _tau(tables[0].mean(axis=1), tables[1].mean(axis=1))
        found.append(Agreement(a.name, b.name, tau, len(shared), low, high))
    return tuple(found)


def _tau(a: Floats, b: Floats) -> float | None:
    """Kendall's tau-b; None where one side has all alike."""
    value = float(stats.kendalltau(a, b, variant="b").statistic)
    return value if np.isfinite(value) else None


def _interval(tables: Sequence[Floats], same_clips: bool) -> tuple[float | None, float | None]:
    """Percentiles over resamples of the clips; the same draw for both sides where they are judged on the same clips."""
    counts = [table.shape[1] for table in tables]
    if min(counts) < FEWEST_CLIPS:
        return None, None
    rng = generator(0, "placement", "tau")
    found = []
    for _ in range(_RESAMPLES):
        first = rng.integers(0, counts[0], counts[0])
        second = first if same_clips else rng.integers(0, counts[1], counts[1])
        tau = _tau(tables[0][:, first].mean(axis=1), tables[1][:, second].mean(axis=1))
        if tau is not None:
            found.append(tau)
    if not found:
        return None, None
    low, high = np.quantile(found, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0])
    return float(low), float(high)
