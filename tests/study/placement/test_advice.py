"""The advice: the smallest size than which no larger one is better, prices, and what a second method says."""

from collections.abc import Mapping

import pytest

from harness.core.seeds import generator
from harness.results.findings import StationNames
from harness.results.findings.advice import SetError, SizeStep
from harness.study.placement.advice import advise, compare_levels, compare_second, find_front, set_error
from harness.study.placement.candidates import Candidate, make_candidate_groups
from harness.study.placement.halving import Race, SearchLimits, race_all
from harness.study.placement.question import list_sets
from harness.study.placement.ranking import Costs

ONE, TWO, THREE = ("c0",), ("c0", "c1"), ("c0", "c1", "c2")
PLACES = make_candidate_groups([Candidate(f"c{n}", "thorax", 0.1 * n) for n in range(4)])


def errors(means: Mapping[StationNames, float], spread: float = 0.2, units: int = 32) -> dict[StationNames, Costs]:
    return {
        names: {f"performer {n}": mean + n % 5 + spread * generator(1, n, *names).normal() for n in range(units)}
        for names, mean in means.items()
    }


def races(means: Mapping[int, float]) -> dict[int, Race]:
    """One race of each size, in which each set errs by the mean of its size."""
    sets = {size: list_sets(size, PLACES, ()) for size in means}
    limits = SearchLimits(8, 1, 10_000, lambda names: float(len(names)))
    found = race_all(
        sets,
        lambda asked, units: {s: {f"performer {n}": means[len(s)] + n for n in range(units)} for s in asked},
        limits,
    )
    return {race.size: race for race in found}


@pytest.mark.parametrize(
    ("means", "size", "why", "verdicts"),
    [
        ({ONE: 5.0, TWO: 4.0, THREE: 3.0}, 3, "largest", ["better", "better", "better"]),
        ({ONE: 5.0, TWO: 4.0, THREE: 4.5}, 2, "between", ["better", "better", "worse"]),
        ({ONE: 4.0, TWO: 4.0, THREE: 4.02}, 1, "smallest", ["cannot tell"] * 3),
        ({ONE: 4.0, TWO: 4.7, THREE: 3.5}, 3, "largest", ["worse", "better", "better"]),
        ({TWO: 4.0}, 2, "only", []),
    ],
)
def test_the_smallest_size_is_advised_than_which_no_larger_one_is_better(
    means: Mapping[StationNames, float], size: int, why: str, verdicts: list[str]
) -> None:
    held = errors(means)
    steps = compare_levels(list(means), held)
    assert [step.verdict for step in steps] == verdicts
    by_name = {names: set_error(names, costs) for names, costs in held.items()}
    advice = advise(list(means), steps, by_name, races({len(names): mean for names, mean in means.items()}))
    assert advice is not None
    assert (len(advice.best.stations), advice.why) == (size, why)
    assert (advice.best.units, advice.best.low is not None) == (32, True)


def test_a_larger_set_that_errs_more_than_a_smaller_one_is_not_advised() -> None:
    steps = [SizeStep(ONE, TWO, -0.1), SizeStep(ONE, THREE, 0.2, verdict="better"), SizeStep(TWO, THREE, 0.3)]
    by_name: dict[StationNames, SetError] = {
        ONE: SetError(ONE, 4.0),
        TWO: SetError(TWO, 4.1),
        THREE: SetError(THREE, 3.8),
    }
    advice = advise([ONE, TWO, THREE], steps, by_name, races({1: 4.0, 2: 4.1, 3: 3.8}))
    assert advice is not None
    assert advice.best.stations == THREE


def test_a_difference_that_a_few_performers_show_is_no_reason_for_more_stations() -> None:
    few = {names: dict(list(costs.items())[:5]) for names, costs in errors({ONE: 5.0, TWO: 3.0}).items()}
    assert compare_levels([ONE, TWO], few)[0].verdict == "cannot tell"


def test_nothing_measured_gives_no_advice_and_no_error() -> None:
    assert advise([], (), {}, {}) is None
    assert set_error(ONE, {"performer 1": 2.0, "performer 2": None}).error is None


def test_a_cheaper_set_than_the_best_of_its_size_has_none_of_its_ties() -> None:
    found = races({1: 5.0})
    costs: dict[StationNames, SetError] = {names: set_error(names, {"performer 1": 5.0}) for names in (ONE, ("c1",))}
    best, cheaper = (advise([names], (), costs, found) for names in costs)
    assert best is not None
    assert cheaper is not None
    assert (len(best.ties), cheaper.ties) == (3, ())


def test_the_front_leaves_out_what_costs_more_and_errs_more() -> None:
    found = races({1: 5.0, 2: 4.0, 3: 4.5})
    assert [len(names) for names in find_front(list(found.values()), lambda names: float(len(names)))] == [1, 2]
    price = {"c0": 3.0, "c1": 1.0, "c2": 1.0, "c3": 1.0}
    front = find_front(list(found.values()), lambda names: sum(price[name] for name in names))
    assert [sum(price[name] for name in names) for name, names in zip(front, front, strict=True)] == [1.0, 2.0]


def test_a_second_method_disagrees_only_if_its_own_best_set_is_significantly_better() -> None:
    apart = compare_second(ONE, errors({ONE: 5.0, TWO: 4.0, THREE: 4.9}))
    assert apart is not None
    assert (apart.worse, apart.best, apart.of, apart.units) == (True, TWO, 3, 32)
    assert apart.difference == pytest.approx(1.0, abs=0.15)
    assert apart.shared is None
    near = compare_second(ONE, errors({ONE: 4.01, TWO: 4.0}, spread=1.0))
    assert near is not None
    assert not near.worse
    own = compare_second(TWO, errors({ONE: 5.0, TWO: 4.0}))
    assert own is not None
    assert (own.best, own.difference, own.worse) == (TWO, 0.0, False)
    assert compare_second(ONE, {ONE: {"performer 1": None}}) is None


def test_a_set_is_good_under_both_methods_if_it_is_tied_under_the_first_and_not_worse_under_the_second() -> None:
    """Of two ties the better one under the second method, even if another set is the best there by chance."""
    under_second = errors({ONE: 5.0, TWO: 4.01, THREE: 4.0, ("c3",): 4.5})
    ties = [("c3",), TWO]
    shared = compare_second(ONE, under_second, ties)
    assert shared is not None
    assert (shared.best, shared.worse, shared.shared) == (THREE, True, SetError(TWO))
    for nobody in ([("c3",)], [], [ONE]):  # worse than two others; no ties
        choice = compare_second(ONE, under_second, nobody)
        assert choice is not None
        assert choice.shared is None
    near = compare_second(ONE, errors({ONE: 4.01, TWO: 4.0}, spread=1.0), [TWO])
    assert near is not None
    assert (near.worse, near.shared) == (False, None)
