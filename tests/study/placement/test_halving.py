"""Searching by halves, on costs whose truth is known: rounds, budgets, ties, prices, and sets that nothing measures."""

from collections.abc import Mapping, Sequence

import pytest

from harness.compare import compare_paired
from harness.core.seeds import generator
from harness.results.findings import StationNames
from harness.study.placement.candidates import Candidate, StationSet, make_candidate_groups, names_of_places
from harness.study.placement.effort import (
    EFFORTS,
    FINALISTS,
    count_cells,
    effort_within,
    keep_count,
    last_round,
    plan_rounds,
)
from harness.study.placement.halving import Race, SearchLimits, add_stations, race_all
from harness.study.placement.question import count_sets, list_sets
from harness.study.placement.ranking import Costs

PLACES = make_candidate_groups(
    [
        Candidate("ankle", "rtibia", 0.9, 90.0, pair="together"),
        *(Candidate(f"c{n}", "thorax", 0.1 * n) for n in range(8)),
    ]
)
SAVES = {"right_ankle": 0.5, "left_ankle": 0.5} | {f"c{n}": 0.3 * n for n in range(8)}
"""What each station saves: c7 and c6 are the best."""


class Performers:
    """Costs that add up, and differ between performers by more than most sets differ."""

    def __init__(self, spread: float, broken: StationNames = ()) -> None:
        self.asked: list[tuple[int, int]] = []
        """Number of sets and of units of each request."""
        self.cells: set[tuple[StationNames, int]] = set()
        self.spread, self.broken = spread, broken

    def __call__(self, sets: Sequence[StationSet], units: int) -> Mapping[StationSet, Costs]:
        self.asked.append((len(sets), units))
        self.cells |= {(names_of_places(stations), unit) for stations in sets for unit in range(units)}
        return {stations: {f"performer {n}": self.cost(stations, n) for n in range(units)} for stations in sets}

    def cost(self, stations: StationSet, unit: int) -> float | None:
        names = names_of_places(stations)
        if names == self.broken:
            return None
        skill = 3.0 * generator(2, "performer", unit).normal()
        return 10.0 + skill - sum(SAVES[n] for n in names) + self.spread * generator(1, unit, *names).normal()


def limits(cells: int, units: int = 48, price: Mapping[str, float] | None = None) -> SearchLimits:
    return SearchLimits(units, 1, cells, lambda names: sum((price or {}).get(name, 1.0) for name in names))


def race(size: int, measure: Performers, to: SearchLimits) -> Race:
    (found,) = race_all({size: list_sets(size, PLACES[1:], ())}, measure, to)
    return found


def test_the_worse_half_goes_and_performers_double_until_all_are_used() -> None:
    measure = Performers(spread=4.0)
    found = race(3, measure, limits(624))
    assert [(one.sets, one.units, one.kept) for one in found.rounds][:2] == [(56, 4, 28), (28, 8, 14)]
    assert [one.units for one in found.rounds] == [4, 8, 16, 32, 48]
    assert all(one.kept == then.sets for one, then in zip(found.rounds, found.rounds[1:], strict=False))
    assert measure.asked == [(one.sets, one.units) for one in found.rounds]
    assert len(measure.cells) <= 624
    assert {unit for names, unit in measure.cells if names == found.best} == set(range(48))


@pytest.mark.parametrize("seed", range(5))
def test_the_best_set_is_found_or_one_that_is_nearly_as_good(seed: int) -> None:
    """The spread of a paired difference is 1.4 times 0.6; the first three sets save 0.3 less each."""
    measure = Performers(spread=0.6)
    measure.cost = lambda stations, unit, own=measure.cost: own(stations, unit + 100 * seed)  # type: ignore[method-assign, misc]
    found = race(3, measure, limits(1000))
    assert sum(SAVES[name] for name in found.best) >= sum(SAVES[f"c{n}"] for n in (5, 6, 7)) - 0.3


def test_what_is_significantly_worse_goes_before_its_half_does() -> None:
    found = race(2, Performers(spread=0.01), limits(10_000, units=12))
    assert [one.units for one in found.rounds] == [12]  # every set fits on all units: nothing is left out
    few = race(2, Performers(spread=0.01), limits(28 * 8, units=12))
    assert few.rounds[-1].kept < FINALISTS
    assert few.best == ("c6", "c7")


def test_sets_that_cannot_be_told_apart_are_ties_and_others_are_not() -> None:
    near = race(3, Performers(spread=4.0), limits(700)).ranking("3 of 8").rows
    assert len(near) == 56
    assert [row.rank for row in near] == list(range(1, 57))
    assert sum(row.tied for row in near) > 1
    assert all(row.units == 48 for row in near if row.tied)
    assert near[-1].units < 48
    assert not near[-1].tied
    clear = race(3, Performers(spread=0.01), limits(10_000)).ranking("3 of 8").rows
    assert [row.tied for row in clear[:2]] == [True, False]


def test_a_left_out_set_is_compared_on_the_units_that_it_was_measured_on() -> None:
    measure = Performers(spread=2.0)
    found = race(3, measure, limits(700))
    row = found.ranking("").rows[-1]
    last = next(costs for stations, costs in found.costs.items() if names_of_places(stations) == row.stations)
    best = next(costs for stations, costs in found.costs.items() if names_of_places(stations) == found.best)
    assert row.difference == compare_paired(last, best).mean
    assert len(last) == row.units < len(best)


def test_no_round_begins_for_which_the_cells_do_not_suffice() -> None:
    measure = Performers(spread=2.0)
    found = race(3, measure, limits(120))
    assert len(measure.cells) <= 120
    assert found.rounds[-1].kept == found.rounds[-1].sets  # nothing is left out without a further round
    assert found.rounds[-1].units < 48
    alike = Performers(spread=9.0)  # nothing is significantly worse, as the forecast supposes
    found = race(3, alike, limits(120))
    ladder = plan_rounds([56], 48, 1, 120)
    assert last_round([56], ladder, 1, 120) == (len(alike.cells), found.rounds[-1].units)
    assert last_round([56], ladder, 1, 10) == (56, 1)  # the first round is always there


def test_a_set_that_is_not_measured_on_every_unit_is_left_out() -> None:
    best = race(3, Performers(spread=0.01), limits(700)).best
    without = race(3, Performers(spread=0.01, broken=best), limits(700))
    assert without.best != best
    assert best not in without.finalists


def test_a_cheap_set_is_not_left_out_for_a_dearer_one() -> None:
    """c7 costs nine: the sets without it are on the front, though all of them err more."""
    dear = limits(2000, price={"c7": 9.0})
    found = race(2, Performers(spread=0.05), dear)
    assert ("c5", "c6") in found.finalists
    assert ("c6", "c7") in found.finalists
    assert ("c5", "c6") not in race(2, Performers(spread=0.05), limits(28 * 8 * 2)).finalists


def test_stations_are_added_one_after_another_and_pairs_count_as_two() -> None:
    measure = Performers(spread=0.05)
    races = add_stations(PLACES, (), 3, measure, limits(600))
    assert [one.best for one in races] == [("c7",), ("c6", "c7"), ("c5", "c6", "c7")]
    assert ("right_ankle", "left_ankle", "c7") in {names_of_places(s) for s in races[2].sets}
    given = add_stations(PLACES, PLACES[:1], 3, measure, limits(600))
    assert [one.best for one in given] == [("right_ankle", "left_ankle"), ("right_ankle", "left_ankle", "c7")]
    assert given[1].base == ("right_ankle", "left_ankle")


def test_sets_are_counted_as_they_are_listed() -> None:
    for base in ((), PLACES[:1], PLACES[-2:]):
        for size in range(1, 7):
            wanted = size >= sum(map(len, base))
            listed = list_sets(size, PLACES, base) if wanted else []
            assert all(len(stations) == size for stations in listed)
            assert len(set(listed)) == len(listed) == (count_sets(size, PLACES, base) if wanted else 0)
            assert all(place in stations for stations in listed for group in base for place in group)


def test_the_plan_of_rounds_keeps_within_its_cells() -> None:
    for sets in ([3], [56], [15, 20, 15], [165], [400]):
        for budget in EFFORTS.values():
            ladder = plan_rounds(sets, 48, 2, budget.cells)
            assert not ladder or ladder[-1] == 48
            if ladder and ladder[0] > 1:
                assert count_cells(sets, ladder, 2) <= budget.cells
    assert plan_rounds([56], 48, 1, 4000) == (48,)
    assert plan_rounds([56], 48, 1, 1600) == (16, 32, 48)
    assert plan_rounds([15504], 48, 1, 4000) == ()
    assert keep_count(56) == 28
    assert keep_count(7) == FINALISTS
    assert keep_count(1) == 1


def test_a_more_thorough_effort_asks_for_more_units_in_the_first_round() -> None:
    first = [plan_rounds([56], 48, 1, budget.cells)[0] for budget in EFFORTS.values()]
    assert first == sorted(set(first))


@pytest.mark.parametrize(
    ("minutes", "effort"),
    [
        (0.1, "quick"),
        (1.0, "quick"),
        (3.9, "quick"),
        (4.0, "normal"),
        (10.0, "normal"),
        (12.0, "thorough"),
        (99.0, "thorough"),
    ],
)
def test_minutes_choose_the_effort_by_the_table(minutes: float, effort: str) -> None:
    assert effort_within(minutes) == effort
