"""Successive halving (Karnin, Koren and Somekh 2013; Jamieson and Talwalkar 2016) over sets of stations.

Every set is measured on a few units. The worse half is left out, by mean paired difference, and so is every set that is
significantly worse than the best (sign flips over units, corrected by Holm). The others are measured on twice as many
units, and so on, until the units or the cells are used up. A few sets are always kept, so that the last round can tell
which ones are tied. Noise is drawn by station and clip, so that sets are compared under the same draws.

With costs a set competes with those that cost as much or less: what is best for its price is not left out for a dearer
one. Where even one round of all sets is too much, one station after another is added, each by halves.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from harness.compare import MIN_UNITS, SIGNIFICANCE, compare_paired, holm, sign_flip_p
from harness.results.findings import RankedSet, Ranking, StationNames
from harness.results.findings.advice import HalvingRound
from harness.study.placement.candidates import CandidateGroup, StationSet, names_of_places, station_set
from harness.study.placement.effort import keep_count, plan_rounds
from harness.study.placement.ranking import Costs, complete_sets, rank_sets, sort_by_cost

MeasureUnits = Callable[[Sequence[StationSet], int], Mapping[StationSet, Costs]]
"""Measures sets on the first so many units: set -> unit -> cost."""
Price = Callable[[StationNames], float]


@dataclass
class Race:
    """Sets of one size, as they are compared and left out."""

    sets: list[StationSet]
    base: StationNames = ()
    """The stations that are in all of them, where one station after another is added."""
    costs: dict[StationSet, Costs] = field(default_factory=dict)
    """Set -> its costs on all units on which it was measured."""
    left_out: dict[StationSet, None] = field(default_factory=dict)
    """The sets that were left out, the last one first."""
    rounds: list[HalvingRound] = field(default_factory=list)

    @property
    def size(self) -> int:
        """Number of stations of each set."""
        return len(self.sets[0])

    @property
    def live(self) -> list[StationSet]:
        """The sets that were not left out."""
        return [stations for stations in self.sets if stations not in self.left_out]

    @property
    def finalists(self) -> dict[StationNames, dict[str, float]]:
        """Costs of the sets that were not left out, on the same units."""
        complete, _ = complete_sets({names_of_places(s): self.costs.get(s, {}) for s in self.live})
        return complete

    @property
    def best(self) -> StationNames:
        """The best set; () if none was measured."""
        return next(iter(sort_by_cost(self.finalists)), ())

    @property
    def ties(self) -> tuple[StationNames, ...]:
        """Finalists beside the best set that are not significantly worse than it, the best first."""
        return tuple(row.stations for row in rank_sets("halve", "", self.finalists).rows[1:] if row.tied)

    def ranking(self, title: str) -> Ranking:
        """All sets, best first: the finalists with their ties, then those that were left out, the last one first."""
        rows = [replace(row, units=self.rounds[-1].units) for row in rank_sets("halve", title, self.finalists).rows]
        best = next((self.costs[s] for s in self.sets if names_of_places(s) == self.best), {})
        for stations in self.left_out:
            gap = compare_paired(self.costs[stations], best)
            least = 2 if gap.low is not None and gap.low > 0.0 else 1
            last = len(self.sets)
            rows.append(
                RankedSet(
                    *(names_of_places(stations), len(rows) + 1, least, last, gap.mean, gap.low, gap.high),
                    units=len(gap.units),
                )
            )
        return Ranking("halve", title, tuple(rows), self.base)


@dataclass(frozen=True)
class SearchLimits:
    """What a search has at its disposal, and what sets cost."""

    units: int
    """Number of units on which sets may be chosen."""
    clips: int
    """Number of clips of a unit."""
    cells: int
    """Most cells."""
    price: Price
    """Total cost of a set; equal for all sets of a size if the number of stations is the cost."""


def halve(races: Sequence[Race], measure: MeasureUnits, ladder: Sequence[int], limits: SearchLimits) -> None:
    """Run the rounds of several races together, on as many units as `ladder` says for each (see `plan_rounds`).

    No round is begun for which the cells do not suffice.
    """
    used = before = 0
    for at, units in enumerate(ladder):
        live = [race.live for race in races]
        used += sum(map(len, live)) * (units - before) * limits.clips
        costs = measure([stations for sets in live for stations in sets], units)
        for race, sets in zip(races, live, strict=True):
            race.costs |= {stations: costs[stations] for stations in sets}
        kept = [_keep(race, sets, limits.price) for race, sets in zip(races, live, strict=True)]
        further = ladder[at + 1] if at + 1 < len(ladder) else units
        needed = sum(map(len, kept)) * (further - units) * limits.clips
        decided = max(map(len, kept)) < 2
        last = decided or not needed or used + needed > limits.cells
        for race, sets, better in zip(races, live, kept, strict=True):
            chosen = sets if last and not decided else better
            race.rounds.append(HalvingRound(race.size, len(sets), units, len(chosen), race.base))
            worse = [stations for stations in _order(race, sets) if stations not in chosen]
            race.left_out = dict.fromkeys([*worse, *race.left_out])
        if last:
            return
        before = units


def _order(race: Race, sets: Sequence[StationSet]) -> list[StationSet]:
    """Sets by mean cost, the best first; those that were not measured on every unit are last."""
    complete, _ = complete_sets({names_of_places(stations): race.costs[stations] for stations in sets})
    rank = {names: at for at, names in enumerate(sort_by_cost(complete))}
    return sorted(sets, key=lambda stations: rank.get(names_of_places(stations), len(sets)))


def _keep(race: Race, sets: Sequence[StationSet], price: Price) -> list[StationSet]:
    """The better half of some sets, without those that are significantly worse than the best."""
    complete, _ = complete_sets({names_of_places(stations): race.costs[stations] for stations in sets})
    order = sort_by_cost(complete)
    rival = {names: next(other for other in order if price(other) <= price(names)) for names in order}
    gaps = {
        names: np.array([complete[names][unit] - complete[rival[names]][unit] for unit in complete[names]])
        for names in order
    }
    tested = [names for names in order if rival[names] != names and len(gaps[names]) >= MIN_UNITS]
    p = dict(zip(tested, holm([sign_flip_p(gaps[names]) for names in tested]), strict=True))
    possible = [names for names in order if p.get(names, 1.0) > SIGNIFICANCE]
    by_gap = sorted(possible, key=lambda names: (rival[names] != names, float(gaps[names].mean()), order.index(names)))
    front = sum(rival[names] == names for names in order)
    chosen = set(by_gap[: max(keep_count(len(sets)), front)])
    return [stations for stations in sets if names_of_places(stations) in chosen]


def race_all(sets: Mapping[int, Sequence[StationSet]], measure: MeasureUnits, limits: SearchLimits) -> list[Race]:
    """One race of each size, together."""
    races = [Race(list(same_size)) for same_size in sets.values()]
    ladder = plan_rounds([len(race.sets) for race in races], limits.units, limits.clips, limits.cells)
    halve(races, measure, ladder, limits)
    return races


def add_stations(
    groups: Sequence[CandidateGroup],
    base: Sequence[CandidateGroup],
    most: int,
    measure: MeasureUnits,
    limits: SearchLimits,
) -> list[Race]:
    """One race for each number of stations from that of `base` to `most`: each adds a group to the best set so far.

    A set of two more stations is the best set with a pair, or the best set of one more with another station.
    """
    known, races = {sum(map(len, base)): list(base)}, list[Race]()
    fixed = min(known)
    limits = replace(limits, cells=limits.cells // max(most - fixed, 1))
    for size in range(max(fixed, 1), most + 1):
        extended = {
            station_set([*known[size - len(group)], group], groups): [*known[size - len(group)], group]
            for group in groups
            if group not in known.get(size - len(group), [group])
        }
        if size == fixed:
            extended = {station_set(base, groups): list(base)}
        if not extended:
            continue
        shared = set.intersection(*(set(names_of_places(stations)) for stations in extended))
        race = Race(list(extended), tuple(name for name in names_of_places(next(iter(extended))) if name in shared))
        ladder = plan_rounds([len(extended)], limits.units, limits.clips, limits.cells) or (1,)
        halve([race], measure, ladder, limits)
        if not race.best:
            break
        races.append(race)
        known[size] = next(chosen for stations, chosen in extended.items() if names_of_places(stations) == race.best)
    return races
