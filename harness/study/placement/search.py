"""Search modes of a placement study: leave one out, add one, greedy, exhaustive.

A mode requests the costs of sets and evaluates them. Modes request the same sets several times, so the measuring
function caches them. Costs are errors, with the opposite sign where high values are good: lower is better.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

import numpy as np

from harness.compare import PairedDifference, compare_paired
from harness.errors import BadInput
from harness.results.findings import MarginalContribution, PlacementSearch, Ranking, SearchStep, StationNames
from harness.study.placement.candidates import (
    CandidateGroup,
    StationSet,
    names_of_places,
    select_groups,
    station_set,
)
from harness.study.placement.config import (
    AblateOptions,
    AddOptions,
    ExhaustiveOptions,
    GreedyOptions,
    check_station_count,
)
from harness.study.placement.ranking import Costs, Measure, complete_sets, join_names, rank_sets, sort_by_cost

ModeResult = tuple[tuple[Ranking, ...], tuple[MarginalContribution, ...]]
"""Rankings and contributions that a mode found."""


def ablate(table: AblateOptions, units: Sequence[CandidateGroup], measure: Measure) -> ModeResult:
    """Rank the full set without each unit; the contribution of a unit is the increase of the cost without it."""
    full, reduced = ablation_sets(table, units)
    costs = measure([full, *reduced.values()])
    sets = {names_of_places(stations): costs[stations] for stations in reduced.values()}
    ranking = rank_sets("ablate", f"{join_names(names_of_places(full))}: each left out", sets, names_of_places(full))
    contributions = [
        contribution(
            place.name,
            "ablate",
            names_of_places(full),
            compare_paired(_measured_costs(costs[rest]), _measured_costs(costs[full])),
        )
        for unit, rest in reduced.items()
        for place in unit
    ]
    return (ranking,), tuple(contributions)


def ablation_sets(
    table: AblateOptions, units: Sequence[CandidateGroup]
) -> tuple[StationSet, dict[CandidateGroup, StationSet]]:
    """The full set, and unit -> the set without it; BadInput where no station would remain."""
    full = select_groups(table.full, units, "ablate.full")
    check_station_count(sum(map(len, full)), "ablate.full")
    if len(full) < 2:
        raise BadInput("ablate.full has one unit, without which no station remains.", "Name two or more.")
    return station_set(full, units), {unit: station_set([u for u in full if u != unit], units) for unit in full}


def add(table: AddOptions, units: Sequence[CandidateGroup], measure: Measure) -> ModeResult:
    """Rank a base set with each unit added, or the units alone; a unit contributes the decrease of the cost."""
    base, extended = addition_sets(table, units)
    costs = measure([*([base] if base else []), *extended.values()])
    sets = {names_of_places(stations): costs[stations] for stations in extended.values()}
    title = f"{join_names(names_of_places(base))}: each added" if base else "each alone"
    contributions = [
        contribution(
            place.name,
            "add",
            names_of_places(base),
            compare_paired(_measured_costs(costs[base]), _measured_costs(costs[both])),
        )
        for unit, both in extended.items()
        for place in unit
        if base
    ]
    return (rank_sets("add", title, sets, names_of_places(base)),), tuple(contributions)


def addition_sets(
    table: AddOptions, units: Sequence[CandidateGroup]
) -> tuple[StationSet, dict[CandidateGroup, StationSet]]:
    """The base set, and unit -> the base set with it."""
    base = select_groups(table.base, units, "add.base") if table.base else ()
    added = [unit for unit in select_groups(table.of, units, "add.of") if unit not in base]
    extended = {unit: station_set([*base, unit], units) for unit in added}
    check_station_count(max(map(len, extended.values()), default=0), "add.of")
    return station_set(base, units), extended


def search_exhaustive(table: ExhaustiveOptions, units: Sequence[CandidateGroup], measure: Measure) -> ModeResult:
    """Rank all sets of each size; the contribution of a unit is its Shapley value over them."""
    sets = exhaustive_sets(table, units)
    costs = measure(sets)
    sizes = {
        size: [stations for stations in sets if len(stations) == size]
        for size in sorted({len(stations) for stations in sets})
    }
    of = select_groups(table.of, units, "exhaustive.of")
    count = sum(map(len, of))
    rankings = [
        rank_sets(
            "exhaustive",
            f"{size} of {count} stations",
            {names_of_places(stations): costs[stations] for stations in same_size},
        )
        for size, same_size in sizes.items()
    ]
    return tuple(rankings), tuple(shapley_contributions(of, units, costs))


def exhaustive_sets(table: ExhaustiveOptions, units: Sequence[CandidateGroup]) -> list[StationSet]:
    """All sets of `fewest` to `most` stations, the smallest first."""
    of = select_groups(table.of, units, "exhaustive.of")
    combined = itertools.chain.from_iterable(itertools.combinations(of, n) for n in range(1, table.most + 1))
    sets = [station_set(groups, units) for groups in combined if table.fewest <= sum(map(len, groups)) <= table.most]
    return sorted(sets, key=len)


def check_cell_count(table: ExhaustiveOptions, units: Sequence[CandidateGroup], cells_each: int) -> None:
    """BadInput when there are no sets, or more cells than the study allows; the message estimates the duration."""
    of = select_groups(table.of, units, "exhaustive.of")
    sets = _count_sets(tuple(map(len, of)), table.fewest, table.most)
    cells = sets * cells_each
    if not sets:
        raise BadInput(f"exhaustive: no set of {table.fewest} to {table.most} stations.", "Change fewest or most.")
    if cells > table.most_cells:
        stations = sum(map(len, of))
        raise BadInput(
            f"exhaustive: {sets:,} sets of up to {table.most} of {stations} stations are {cells:,} cells, about "
            f"{_format_duration(cells)} for one worker at 1 s each; the limit is {table.most_cells:,} cells.",
            "Lower exhaustive.most, name fewer in exhaustive.of, use [greedy], or raise exhaustive.most_cells.",
        )


def _count_sets(sizes: Sequence[int], fewest: int, most: int) -> int:
    """Number of combinations of units with `fewest` to `most` stations, computed without listing them."""
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
    """Add one unit after another, each time the one that gives the lowest mean cost."""
    chosen = list(select_groups(table.base, units, "greedy.base") if table.base else ())
    of = select_groups(table.of, units, "greedy.of")
    most, title = table.most, f"up to {table.most} stations, one after another"
    steps = [SearchStep(names_of_places(station_set(chosen, units)), "")] if chosen else []
    while True:
        current = station_set(chosen, units)
        extended = {
            station_set([*chosen, unit], units): unit
            for unit in of
            if unit not in chosen and len(current) + len(unit) <= most
        }
        if not extended:
            return PlacementSearch(
                "greedy", title, tuple(steps), f"{len(current)} stations; no further unit fits into {most}"
            )
        costs = measure([*([current] if current else []), *extended])
        complete, _ = complete_sets({names_of_places(stations): costs[stations] for stations in extended})
        if not complete:
            return PlacementSearch("greedy", title, tuple(steps), "nothing was measured")
        rows = rank_sets("greedy", "", complete).rows
        labels = {
            names_of_places(stations): join_names(place.name for place in unit) for stations, unit in extended.items()
        }
        best = next(stations for stations in extended if names_of_places(stations) == rows[0].stations)
        gain = (
            compare_paired(_measured_costs(costs[current]), _measured_costs(costs[best]))
            if current
            else PairedDifference((), None)
        )
        tied = tuple(labels[row.stations] for row in rows[1:] if row.tied)
        changed = f"+ {labels[rows[0].stations]}"
        steps.append(SearchStep(rows[0].stations, changed, gain.mean, gain.low, gain.high, tied))
        chosen.append(extended[best])


def best_measured_set(size: int, costs: Mapping[StationSet, Costs]) -> StationSet:
    """The best measured set of a size; BadInput if none was measured."""
    same_size = {names_of_places(stations): stations for stations in costs if len(stations) == size}
    complete, _ = complete_sets({name: costs[stations] for name, stations in same_size.items()})
    if not complete:
        raise BadInput(f"refine: no set of {size} stations was measured.", "Name it in refine.set.")
    return same_size[sort_by_cost(complete)[0]]


def _measured_costs(costs: Costs) -> Costs:
    return {unit: value for unit, value in costs.items() if value is not None}


def contribution(
    name: str, mode: Literal["ablate", "add", "exhaustive"], base: StationNames, gain: PairedDifference
) -> MarginalContribution:
    return MarginalContribution(name, mode, base, gain.mean, gain.low, gain.high, len(gain.units))


def shapley_contributions(
    units: Sequence[CandidateGroup], order: Sequence[CandidateGroup], costs: Mapping[StationSet, Costs]
) -> Iterator[MarginalContribution]:
    """Shapley value of each unit, over the sets that were measured.

    It is the decrease of the cost when the unit is added, averaged over the sets that it can be added to. Each size of
    sets has the same weight. Where all sets have one size, none can be added to: it is then the mean cost of the sets
    without the unit minus that of the sets with it.
    """
    if len({len(stations) for stations in costs}) == 1:
        yield from _contributions_at_one_size(units, costs)
        return
    for unit in units:
        sizes: dict[int, list[tuple[StationSet, StationSet]]] = {}
        for stations in costs:
            if not set(unit) & set(stations) and (extended := station_set([stations, unit], order)) in costs:
                sizes.setdefault(len(stations), []).append((stations, extended))
        without = _mean_by_unit([_mean_by_unit([costs[stations] for stations, _ in pairs]) for pairs in sizes.values()])
        with_unit = _mean_by_unit(
            [_mean_by_unit([costs[extended] for _, extended in pairs]) for pairs in sizes.values()]
        )
        gain = compare_paired(without, with_unit)
        yield from (contribution(place.name, "exhaustive", (), gain) for place in unit)


def _contributions_at_one_size(
    units: Sequence[CandidateGroup], costs: Mapping[StationSet, Costs]
) -> Iterator[MarginalContribution]:
    """For each unit, the mean cost of the sets without it minus the mean cost of those with it."""
    for unit in units:
        having = [costs[stations] for stations in costs if set(unit) <= set(stations)]
        lacking = [costs[stations] for stations in costs if not set(unit) & set(stations)]
        gain = compare_paired(_mean_by_unit(lacking), _mean_by_unit(having))
        yield from (contribution(place.name, "exhaustive", (), gain) for place in unit)


def _mean_by_unit(each: Sequence[Costs]) -> dict[str, float | None]:
    """Unit -> mean of several costs; None where one of them is missing."""
    out: dict[str, float | None] = {}
    for unit in dict.fromkeys(unit for costs in each for unit in costs):
        values = [costs.get(unit) for costs in each]
        measured = [value for value in values if value is not None]
        out[unit] = float(np.mean(measured)) if len(measured) == len(values) else None
    return out
