"""Which trackers to wear: each left out, each added, one after another, or every set of so many.

A mode asks for the costs of sets and says what they come to. Modes ask for the same sets again and again; whoever
measures remembers them. Costs are errors, with the sign turned where high values are good: the less the better.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.compare.paired_statistics import Paired, paired
from harness.errors import BadInput
from harness.results.placement_findings import Ranking, Search, Stations, Step, Worth
from harness.study.placement.candidates import Unit, Worn, chosen, worn
from harness.study.placement.config import Ablate, Add, Exhaustive, Greedy, fits
from harness.study.placement.ranking import Costs, complete, in_order, names, rank

Measure = Callable[[Sequence[Worn]], Mapping[Worn, Costs]]
"""Tries sets: what each costs on each clip."""


@dataclass(frozen=True)
class Found:
    """What a mode came to."""

    rankings: tuple[Ranking, ...] = ()
    worth: tuple[Worth, ...] = ()


def ablate(table: Ablate, units: Sequence[Unit], measure: Measure) -> Found:
    """The full set less each unit, and what each is worth there."""
    full, less = ablated(table, units)
    costs = measure([full, *less.values()])
    sets = {stations(one): costs[one] for one in less.values()}
    ranking = rank("ablate", f"{names(stations(full))}: each left out", sets, stations(full))
    worth = [
        _worth(one.name, "ablate", stations(full), paired(_measured(costs[rest]), _measured(costs[full])))
        for unit, rest in less.items()
        for one in unit
    ]
    return Found((ranking,), tuple(worth))


def ablated(table: Ablate, units: Sequence[Unit]) -> tuple[Worn, dict[Unit, Worn]]:
    """The full set, and unit -> the set without it; BadInput where nothing would be left."""
    full = chosen(table.full, units, "ablate.full")
    fits(sum(map(len, full)), "ablate.full")
    if len(full) < 2:
        raise BadInput("ablate.full is one unit, without which nothing is worn.", "Name two or more.")
    return worn(full, units), {unit: worn([u for u in full if u != unit], units) for unit in full}


def add(table: Add, units: Sequence[Unit], measure: Measure) -> Found:
    """A base set and each unit, and what each is worth there; without a base each unit alone."""
    base, more = added(table, units)
    costs = measure([*([base] if base else []), *more.values()])
    sets = {stations(one): costs[one] for one in more.values()}
    title = f"{names(stations(base))}: each added" if base else "each alone"
    worth = [
        _worth(one.name, "add", stations(base), paired(_measured(costs[base]), _measured(costs[both])))
        for unit, both in more.items()
        for one in unit
        if base
    ]
    return Found((rank("add", title, sets, stations(base)),), tuple(worth))


def added(table: Add, units: Sequence[Unit]) -> tuple[Worn, dict[Unit, Worn]]:
    """The base, and unit -> the base with it."""
    base = chosen(table.base, units, "add.base") if table.base else ()
    of = [unit for unit in chosen(table.of, units, "add.of") if unit not in base]
    more = {unit: worn([*base, unit], units) for unit in of}
    fits(max(map(len, more.values()), default=0), "add.of")
    return worn(base, units), more


def exhaustive(table: Exhaustive, units: Sequence[Unit], measure: Measure) -> Found:
    """Every set of so many stations, ranked by size, and what each unit is worth on average over them."""
    sets = every_set(table, units)
    costs = measure(sets)
    sizes = {size: [one for one in sets if len(one) == size] for size in sorted({len(one) for one in sets})}
    of = chosen(table.of, units, "exhaustive.of")
    count = sum(map(len, of))
    rankings = [
        rank("exhaustive", f"{size} of {count} trackers", {stations(one): costs[one] for one in alike})
        for size, alike in sizes.items()
    ]
    return Found(tuple(rankings), tuple(_average_worth(of, units, costs)))


def every_set(table: Exhaustive, units: Sequence[Unit]) -> list[Worn]:
    """Of `fewest` to `most` stations, the fewest first."""
    of = chosen(table.of, units, "exhaustive.of")
    combined = itertools.chain.from_iterable(itertools.combinations(of, n) for n in range(1, table.most + 1))
    found = [worn(each, units) for each in combined if table.fewest <= sum(map(len, each)) <= table.most]
    return sorted(found, key=len)


def refuse_absurd(table: Exhaustive, units: Sequence[Unit], cells_each: int) -> None:
    """BadInput when it would be more cells than the study allows: how many, and about how long."""
    of = chosen(table.of, units, "exhaustive.of")
    sets = _count(tuple(map(len, of)), table.fewest, table.most)
    cells = sets * cells_each
    if not sets:
        raise BadInput(f"exhaustive: no set of {table.fewest} to {table.most} stations.", "Change fewest or most.")
    if cells > table.most_cells:
        trackers = sum(map(len, of))
        raise BadInput(
            f"exhaustive: {sets:,} sets of up to {table.most} of {trackers} trackers are {cells:,} cells, about "
            f"{_long(cells)} of one worker at a second each; at most {table.most_cells:,} are run.",
            "Lower exhaustive.most, name fewer in exhaustive.of, use [greedy], or raise exhaustive.most_cells.",
        )


def _count(sizes: Sequence[int], fewest: int, most: int) -> int:
    """How many choices of units have so many stations, without listing them."""
    ways = [1] + [0] * most
    for size in sizes:
        for total in range(most, size - 1, -1):
            ways[total] += ways[total - size]
    return sum(ways[max(fewest, 1) :])


def _long(seconds: float) -> str:
    for unit, length in (("days", 86400.0), ("hours", 3600.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:,.0f} {unit}"
    return f"{seconds / 60.0:,.0f} minutes"


def greedy(table: Greedy, units: Sequence[Unit], measure: Measure) -> Search:
    """One unit after another, each time the one with which the mean cost is least."""
    have = list(chosen(table.base, units, "greedy.base") if table.base else ())
    of = chosen(table.of, units, "greedy.of")
    most, title = table.most, f"up to {table.most} trackers, one after another"
    steps = [Step(stations(worn(have, units)), "")] if have else []
    while True:
        now = worn(have, units)
        more = {worn([*have, unit], units): unit for unit in of if unit not in have and len(now) + len(unit) <= most}
        if not more:
            return Search("greedy", title, tuple(steps), f"{len(now)} stations; no more fit into {most}")
        costs = measure([*([now] if now else []), *more])
        whole, _ = complete({stations(one): costs[one] for one in more})
        if not whole:
            return Search("greedy", title, tuple(steps), "nothing was measured")
        rows = rank("greedy", "", whole).rows
        labels = {stations(one): names(place.name for place in unit) for one, unit in more.items()}
        best = next(one for one in more if stations(one) == rows[0].stations)
        helps = paired(_measured(costs[now]), _measured(costs[best])) if now else Paired((), None)
        tied = tuple(labels[row.stations] for row in rows[1:] if row.tied)
        changed = f"+ {labels[rows[0].stations]}"
        steps.append(Step(rows[0].stations, changed, helps.mean, helps.low, helps.high, tied))
        have.append(more[best])


def best_tried(size: int, costs: Mapping[Worn, Costs]) -> Worn:
    """Of so many stations; BadInput if none was measured."""
    alike = {stations(one): one for one in costs if len(one) == size}
    whole, _ = complete({name: costs[one] for name, one in alike.items()})
    if not whole:
        raise BadInput(f"refine: no set of {size} stations was measured.", "Name it in refine.set.")
    return alike[in_order(whole)[0]]


def stations(one: Worn) -> Stations:
    return tuple(place.name for place in one)


def _measured(costs: Costs) -> Costs:
    return {clip: value for clip, value in costs.items() if value is not None}


def _worth(name: str, mode: Literal["ablate", "add", "exhaustive"], base: Stations, found: Paired) -> Worth:
    return Worth(name, mode, base, found.mean, found.low, found.high, len(found.clips))


def _average_worth(units: Sequence[Unit], order: Sequence[Unit], costs: Mapping[Worn, Costs]) -> Iterator[Worth]:
    """What adding a unit saves, averaged over the sets it can be added to, those of each size together counting alike:
    Shapley's value, as far as the sets were tried."""
    for unit in units:
        sizes: dict[int, list[tuple[Worn, Worn]]] = {}
        for one in costs:
            if not set(unit) & set(one) and (more := worn([one, unit], order)) in costs:
                sizes.setdefault(len(one), []).append((one, more))
        without = _over([_over([costs[one] for one, _ in pairs]) for pairs in sizes.values()])
        having = _over([_over([costs[more] for _, more in pairs]) for pairs in sizes.values()])
        found = paired(without, having)
        yield from (_worth(one.name, "exhaustive", (), found) for one in unit)


def _over(each: Sequence[Costs]) -> dict[str, float | None]:
    """Clip -> mean; None where one of them has none."""
    out: dict[str, float | None] = {}
    for clip in dict.fromkeys(clip for costs in each for clip in costs):
        values = [costs.get(clip) for costs in each]
        measured = [value for value in values if value is not None]
        out[clip] = float(np.mean(measured)) if len(measured) == len(values) else None
    return out
