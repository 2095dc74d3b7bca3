"""Which trackers to wear: each left out, each added, one after another, or every set of so many.

A mode asks for the costs of sets and says what they come to. Modes ask for the same sets again and again; whoever
measures remembers them. Costs are errors, with the sign turned where high values are good: the less the better.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.compare.paired_statistics import PairedDifference, compare_paired
from harness.errors import BadInput
from harness.results.placement_findings import MarginalContribution, PlacementSearch, Ranking, SearchStep, StationNames
from harness.study.placement.candidates import CandidateGroup, StationSet, select_groups, station_set
from harness.study.placement.config import (
    AblateOptions,
    AddOptions,
    ExhaustiveOptions,
    GreedyOptions,
    check_station_count,
)
from harness.study.placement.ranking import Costs, complete_sets, join_names, rank_sets, sort_by_cost

Measure = Callable[[Sequence[StationSet]], Mapping[StationSet, Costs]]
"""Tries sets: what each costs on each clip."""


@dataclass(frozen=True)
class ModeResult:
    """What a mode came to."""

    rankings: tuple[Ranking, ...] = ()
    worth: tuple[MarginalContribution, ...] = ()


def ablate(table: AblateOptions, units: Sequence[CandidateGroup], measure: Measure) -> ModeResult:
    """The full set less each unit, and what each is worth there."""
    full, less = ablation_sets(table, units)
    costs = measure([full, *less.values()])
    sets = {names_of_places(one): costs[one] for one in less.values()}
    ranking = rank_sets("ablate", f"{join_names(names_of_places(full))}: each left out", sets, names_of_places(full))
    worth = [
        _make_worth(
            one.name,
            "ablate",
            names_of_places(full),
            compare_paired(_measured_costs(costs[rest]), _measured_costs(costs[full])),
        )
        for unit, rest in less.items()
        for one in unit
    ]
    return ModeResult((ranking,), tuple(worth))


def ablation_sets(
    table: AblateOptions, units: Sequence[CandidateGroup]
) -> tuple[StationSet, dict[CandidateGroup, StationSet]]:
    """The full set, and unit -> the set without it; BadInput where nothing would be left."""
    full = select_groups(table.full, units, "ablate.full")
    check_station_count(sum(map(len, full)), "ablate.full")
    if len(full) < 2:
        raise BadInput("ablate.full is one unit, without which nothing is worn.", "Name two or more.")
    return station_set(full, units), {unit: station_set([u for u in full if u != unit], units) for unit in full}


def add(table: AddOptions, units: Sequence[CandidateGroup], measure: Measure) -> ModeResult:
    """A base set and each unit, and what each is worth there; without a base each unit alone."""
    base, more = addition_sets(table, units)
    costs = measure([*([base] if base else []), *more.values()])
    sets = {names_of_places(one): costs[one] for one in more.values()}
    title = f"{join_names(names_of_places(base))}: each added" if base else "each alone"
    worth = [
        _make_worth(
            one.name,
            "add",
            names_of_places(base),
            compare_paired(_measured_costs(costs[base]), _measured_costs(costs[both])),
        )
        for unit, both in more.items()
        for one in unit
        if base
    ]
    return ModeResult((rank_sets("add", title, sets, names_of_places(base)),), tuple(worth))


def addition_sets(
    table: AddOptions, units: Sequence[CandidateGroup]
) -> tuple[StationSet, dict[CandidateGroup, StationSet]]:
    """The base, and unit -> the base with it."""
    base = select_groups(table.base, units, "add.base") if table.base else ()
    of = [unit for unit in select_groups(table.of, units, "add.of") if unit not in base]
    more = {unit: station_set([*base, unit], units) for unit in of}
    check_station_count(max(map(len, more.values()), default=0), "add.of")
    return station_set(base, units), more


def search_exhaustive(table: ExhaustiveOptions, units: Sequence[CandidateGroup], measure: Measure) -> ModeResult:
    """Every set of so many stations, ranked by size, and what each unit is worth on average over them."""
    sets = exhaustive_sets(table, units)
    costs = measure(sets)
    sizes = {size: [one for one in sets if len(one) == size] for size in sorted({len(one) for one in sets})}
    of = select_groups(table.of, units, "exhaustive.of")
    count = sum(map(len, of))
    rankings = [
        rank_sets("exhaustive", f"{size} of {count} trackers", {names_of_places(one): costs[one] for one in alike})
        for size, alike in sizes.items()
    ]
    return ModeResult(tuple(rankings), tuple(_shapley_worth(of, units, costs)))


def exhaustive_sets(table: ExhaustiveOptions, units: Sequence[CandidateGroup]) -> list[StationSet]:
    """Of `fewest` to `most` stations, the fewest first."""
    of = select_groups(table.of, units, "exhaustive.of")
    combined = itertools.chain.from_iterable(itertools.combinations(of, n) for n in range(1, table.most + 1))
    found = [station_set(each, units) for each in combined if table.fewest <= sum(map(len, each)) <= table.most]
    return sorted(found, key=len)


def check_cell_count(table: ExhaustiveOptions, units: Sequence[CandidateGroup], cells_each: int) -> None:
    """BadInput when it would be more cells than the study allows: how many, and about how long."""
    of = select_groups(table.of, units, "exhaustive.of")
    sets = _count_sets(tuple(map(len, of)), table.fewest, table.most)
    cells = sets * cells_each
    if not sets:
        raise BadInput(f"exhaustive: no set of {table.fewest} to {table.most} stations.", "Change fewest or most.")
    if cells > table.most_cells:
        trackers = sum(map(len, of))
        raise BadInput(
            f"exhaustive: {sets:,} sets of up to {table.most} of {trackers} trackers are {cells:,} cells, about "
            f"{_format_duration(cells)} of one worker at a second each; at most {table.most_cells:,} are run.",
            "Lower exhaustive.most, name fewer in exhaustive.of, use [greedy], or raise exhaustive.most_cells.",
        )


def _count_sets(sizes: Sequence[int], fewest: int, most: int) -> int:
    """How many choices of units have so many stations, without listing them."""
    ways = [1] + [0] * most
    for size in sizes:
        for total in range(most, size - 1, -1):
            ways[total] += ways[total - size]
    return sum(ways[max(fewest, 1) :])


def _format_duration(seconds: float) -> str:
    for unit, length in (("days", 86400.0), ("hours", 3600.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:,.0f} {unit}"
    return f"{seconds / 60.0:,.0f} minutes"


def search_greedy(table: GreedyOptions, units: Sequence[CandidateGroup], measure: Measure) -> PlacementSearch:
    """One unit after another, each time the one with which the mean cost is least."""
    have = list(select_groups(table.base, units, "greedy.base") if table.base else ())
    of = select_groups(table.of, units, "greedy.of")
    most, title = table.most, f"up to {table.most} trackers, one after another"
    steps = [SearchStep(names_of_places(station_set(have, units)), "")] if have else []
    while True:
        now = station_set(have, units)
        more = {
            station_set([*have, unit], units): unit for unit in of if unit not in have and len(now) + len(unit) <= most
        }
        if not more:
            return PlacementSearch("greedy", title, tuple(steps), f"{len(now)} stations; no more fit into {most}")
        costs = measure([*([now] if now else []), *more])
        whole, _ = complete_sets({names_of_places(one): costs[one] for one in more})
        if not whole:
            return PlacementSearch("greedy", title, tuple(steps), "nothing was measured")
        rows = rank_sets("greedy", "", whole).rows
        labels = {names_of_places(one): join_names(place.name for place in unit) for one, unit in more.items()}
        best = next(one for one in more if names_of_places(one) == rows[0].stations)
        helps = (
            compare_paired(_measured_costs(costs[now]), _measured_costs(costs[best]))
            if now
            else PairedDifference((), None)
        )
        tied = tuple(labels[row.stations] for row in rows[1:] if row.tied)
        changed = f"+ {labels[rows[0].stations]}"
        steps.append(SearchStep(rows[0].stations, changed, helps.mean, helps.low, helps.high, tied))
        have.append(more[best])


def best_measured_set(size: int, costs: Mapping[StationSet, Costs]) -> StationSet:
    """Of so many stations; BadInput if none was measured."""
    alike = {names_of_places(one): one for one in costs if len(one) == size}
    whole, _ = complete_sets({name: costs[one] for name, one in alike.items()})
    if not whole:
        raise BadInput(f"refine: no set of {size} stations was measured.", "Name it in refine.set.")
    return alike[sort_by_cost(whole)[0]]


def names_of_places(one: StationSet) -> StationNames:
    return tuple(place.name for place in one)


def _measured_costs(costs: Costs) -> Costs:
    return {clip: value for clip, value in costs.items() if value is not None}


def _make_worth(
    name: str, mode: Literal["ablate", "add", "exhaustive"], base: StationNames, found: PairedDifference
) -> MarginalContribution:
    return MarginalContribution(name, mode, base, found.mean, found.low, found.high, len(found.clips))


def _shapley_worth(
    units: Sequence[CandidateGroup], order: Sequence[CandidateGroup], costs: Mapping[StationSet, Costs]
) -> Iterator[MarginalContribution]:
    """What adding a unit saves, averaged over the sets it can be added to, those of each size together counting alike:
    Shapley's value, as far as the sets were tried."""
    for unit in units:
        sizes: dict[int, list[tuple[StationSet, StationSet]]] = {}
        for one in costs:
            if not set(unit) & set(one) and (more := station_set([one, unit], order)) in costs:
                sizes.setdefault(len(one), []).append((one, more))
        without = _mean_by_clip([_mean_by_clip([costs[one] for one, _ in pairs]) for pairs in sizes.values()])
        having = _mean_by_clip([_mean_by_clip([costs[more] for _, more in pairs]) for pairs in sizes.values()])
        found = compare_paired(without, having)
        yield from (_make_worth(one.name, "exhaustive", (), found) for one in unit)


def _mean_by_clip(each: Sequence[Costs]) -> dict[str, float | None]:
    """Clip -> mean; None where one of them has none."""
    out: dict[str, float | None] = {}
    for clip in dict.fromkeys(clip for costs in each for clip in costs):
        values = [costs.get(clip) for costs in each]
        measured = [value for value in values if value is not None]
        out[clip] = float(np.mean(measured)) if len(measured) == len(values) else None
    return out
