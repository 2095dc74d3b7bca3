"""Ranks, and what is known of them: they hold in simulated studies whose truth is known."""

from collections.abc import Mapping

import numpy as np
import pytest

from harness.compare import count_needed
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.results.findings import BenchmarkStatement, StationNames
from harness.study.placement.candidates import Candidate, make_candidate_groups, names_of_places
from harness.study.placement.config import PublishedClaim
from harness.study.placement.ranking import (
    ConditionCosts,
    Costs,
    best_alternative,
    best_by_size,
    changed_orders,
    complete_sets,
    cross_validated_cost,
    evaluate_claim,
    mean_cost,
    rank_agreements,
    rank_by_condition,
    rank_sets,
    selection_stability,
    sets_of_claim,
    significant_differences,
    sort_by_cost,
    summarise_set,
)

CLIPS = tuple(f"clip_{n:02}" for n in range(12))
Sets = dict[StationNames, dict[str, float | None]]


def study(means: Mapping[str, float], spread: float, seed: int, clips: tuple[str, ...] = CLIPS) -> Sets:
    """Sets of one station each; clips differ in difficulty, alike for all sets."""
    rng = generator(seed, "study")
    hard = rng.normal(size=len(clips))
    return {
        (name,): dict(zip(clips, (value + hard + spread * rng.normal(size=len(clips))).tolist(), strict=True))
        for name, value in means.items()
    }


def test_clear_differences_leave_no_doubt_about_ranks() -> None:
    ranking = rank_sets("exhaustive", "three", study({"b": 2.0, "c": 3.0, "a": 1.0}, 0.05, 1))
    assert [row.stations for row in ranking.rows] == [("a",), ("b",), ("c",)]
    assert [(row.rank, row.rank_low, row.rank_high, row.tied) for row in ranking.rows] == [
        (1, 1, 1, True),
        (2, 2, 2, False),
        (3, 3, 3, False),
    ]
    for row, truth, step in zip(ranking.rows, (0.0, 1.0, 2.0), (0.0, 1.0, 1.0), strict=True):
        assert row.difference == pytest.approx(truth, abs=0.1)
        assert row.step == pytest.approx(step, abs=0.1)
    low, high = ranking.rows[2].low, ranking.rows[2].high
    assert low is not None
    assert high is not None
    assert low < 2.0 < high


def test_sets_that_differ_by_chance_alone_are_ties() -> None:
    rows = rank_sets("exhaustive", "alike", study(dict.fromkeys("abcd", 1.0), 1.0, 3)).rows
    assert all(row.tied and (row.rank_low, row.rank_high) == (1, 4) for row in rows)


def test_true_ranks_lie_within_their_ranges() -> None:
    """In 19 of 20 for each set: 100 studies of five sets a third of their spread apart."""
    names, missed = "abcde", 0
    for seed in range(100):
        whole, _ = complete_sets(study({name: 0.3 * at for at, name in enumerate(names)}, 1.0, seed))
        order = sort_by_cost(whole)
        better, worse = significant_differences(order, whole)
        for at, worn in enumerate(order):
            true = 1 + names.index(worn[0])
            missed += not 1 + len(better[at]) <= true <= len(order) - len(worse[at])
    assert missed <= 25 + 2 * 5  # of 500; 5 % and two standard deviations


def test_choosing_flatters_and_the_other_clips_say_by_how_much() -> None:
    """Of ten sets that are equally good one looks better than it is; judged where it was not chosen, it does not."""
    flattered, honest = [], []
    for seed in range(200):
        whole, _ = complete_sets(study(dict.fromkeys("abcdefghij", 5.0), 1.0, seed))
        level = float(np.mean([mean_cost(costs) for costs in whole.values()]))
        flattered.append(mean_cost(whole[sort_by_cost(whole)[0]]) - level)
        honest.append(cross_validated_cost(whole) - level)
    assert np.mean(flattered) < -0.3
    assert abs(np.mean(honest)) < 0.05


def test_the_best_stays_the_best_or_does_not() -> None:
    assert selection_stability(complete_sets(study({"a": 1.0, "b": 2.0}, 0.01, 1))[0]) == 1.0
    assert selection_stability(complete_sets(study(dict.fromkeys("abcdefgh", 1.0), 1.0, 1))[0]) < 0.8


def test_a_set_that_misses_a_clip_is_not_ranked_but_named() -> None:
    sets = study({"a": 1.0, "b": 2.0, "c": 3.0}, 0.1, 1)
    for costs in sets.values():
        costs["clip_00"] = None  # on which nothing was measured
    sets["a",]["clip_05"] = None
    whole, left_out = complete_sets(sets)
    assert list(whole) == [("b",), ("c",)]
    assert left_out == ["not ranked: a was measured on 10 of 11 units"]
    assert [row.stations for row in rank_sets("add", "", sets).rows] == [("b",), ("c",)]
    nothing: Sets = {("a",): {"clip": None}}
    assert complete_sets(nothing)[0] == {}
    assert rank_sets("add", "", nothing).rows == ()


@pytest.mark.parametrize("comparisons", [1, 2, 9, 30])
def test_so_many_clips_can_tell_and_one_less_cannot(comparisons: int) -> None:
    sets = {name: 1.0 + at for at, name in enumerate("abcdefghijklmnopqrstuvwxyzABCDE"[: comparisons + 1])}
    enough = count_needed(comparisons)
    for clips, told in ((enough, True), (enough - 1, enough == 6)):  # fewer than 6 never have intervals
        whole, _ = complete_sets(study(sets, 0.0, 1, CLIPS[:clips]))
        better, _ = significant_differences(sort_by_cost(whole), whole)
        assert bool(better[-1]) is told or clips < 6


def test_the_front_is_of_sets_that_no_smaller_one_beats() -> None:
    sets: Sets = {
        worn: dict.fromkeys(CLIPS, cost)
        for worn, cost in {("a",): 3.0, ("b",): 4.0, ("a", "b"): 3.5, ("a", "c"): 3.2, ("a", "b", "c"): 1.0}.items()
    }
    found = best_by_size(sets)
    assert [(best.stations, best.on_front, best.of) for best in found] == [
        (("a",), True, 2),
        (("a", "c"), False, 2),
        (("a", "b", "c"), True, 1),
    ]
    assert [best.cross_validated_error for best in best_by_size(sets, -1.0)] == pytest.approx([-3.0, -3.2, -1.0])


def test_a_mean_has_an_interval_where_clips_suffice() -> None:
    (worn, errors), *_ = study({"a": 2.0}, 0.1, 1).items()
    found = summarise_set(worn, 40.0, errors)
    assert found.low is not None
    assert found.mean is not None
    assert found.high is not None
    assert found.low < found.mean < found.high
    assert summarise_set(worn, 40.0, dict(list(errors.items())[:5])).low is None
    assert summarise_set(worn, 40.0, {"clip": None}).mean is None


EIGHT = tuple(f"clip_{n}" for n in range(8))
SETS: tuple[StationNames, ...] = tuple((name,) for name in "abcdef")


def elsewhere(name: str, means: Floats, noise: Floats | float = 0.0, clips: tuple[str, ...] = EIGHT) -> ConditionCosts:
    table = np.asarray(means)[:, None] + noise * np.ones((1, len(clips)))
    rows = zip(SETS, table.tolist(), strict=True)
    return ConditionCosts(name, "noise", {worn: dict(zip(clips, row, strict=True)) for worn, row in rows})


def test_the_same_order_agrees_and_the_reverse_disagrees() -> None:
    up = np.arange(6.0)
    each = [elsewhere("own", up), elsewhere("alike", 10.0 + 3.0 * up), elsewhere("reversed", -up, clips=EIGHT[:7])]
    found = {(pair.a, pair.b): pair for pair in rank_agreements(each, SETS)}
    assert {names: pair.tau for names, pair in found.items()} == pytest.approx(
        {("own", "alike"): 1.0, ("own", "reversed"): -1.0, ("alike", "reversed"): -1.0}
    )
    assert all(pair.low == pair.tau == pair.high for pair in found.values())
    assert all(pair.sets == 6 for pair in found.values())
    best = {each.name: each.best for each in rank_by_condition(each, SETS, 1.0)}
    assert best == {"own": {"1": ("a",)}, "alike": {"1": ("a",)}, "reversed": {"1": ("f",)}}


def test_noise_widens_the_interval(rng: np.random.Generator) -> None:
    up = np.arange(6.0)
    each = [elsewhere("own", up, 3.0 * rng.normal(size=(6, 8))), elsewhere("other", up, 3.0 * rng.normal(size=(6, 8)))]
    (pair,) = rank_agreements(each, SETS)
    assert pair.tau is not None
    assert pair.low is not None
    assert pair.high is not None
    assert pair.low < pair.tau <= pair.high
    assert pair.high - pair.low > 0.2


def test_what_cannot_be_told_is_not(rng: np.random.Generator) -> None:
    few = [elsewhere(name, np.arange(6.0), clips=EIGHT[:3]) for name in ("own", "other")]
    (pair,) = rank_agreements(few, SETS)
    assert (pair.tau, pair.low, pair.high) == (1.0, None, None)
    alike = [elsewhere("own", np.zeros(6)), elsewhere("other", np.arange(6.0))]
    (pair,) = rank_agreements(alike, SETS)
    assert (pair.tau, pair.low) == (None, None)
    nothing = [elsewhere("own", np.arange(6.0)), ConditionCosts("failed", "noise", {})]
    (pair,) = rank_agreements(nothing, SETS)
    assert (pair.tau, pair.sets) == (None, 0)
    assert rank_by_condition(nothing, SETS, 1.0)[1].means == (None,) * 6


def test_means_are_told_as_the_metric_has_them() -> None:
    (found,) = rank_by_condition([elsewhere("own", -np.arange(6.0))], SETS, -1.0)
    assert found.means == tuple(range(6))
    assert found.best == {"1": ("f",)}


def test_sets_that_swap_are_named_and_the_swap_is_tested(rng: np.random.Generator) -> None:
    up, swapped = np.arange(6.0), np.array([1.0, 0.0, 2.0, 3.0, 4.0, 5.0])
    noise = 0.01 * rng.normal(size=(2, 6, 12))
    clips = tuple(f"clip_{n}" for n in range(12))
    each = [elsewhere(name, means, shake, clips) for name, means, shake in zip("xy", (up, swapped), noise, strict=True)]
    (pair,) = rank_agreements(each, SETS)
    assert (pair.changes, pair.significant_changes) == (1, 1)
    (change,) = pair.changed
    assert (change.first, change.second, change.significant) == (("a",), ("b",), True)
    assert change.differences == pytest.approx((1.0, -1.0), abs=0.05)


def test_a_swap_within_the_noise_is_not_significant(rng: np.random.Generator) -> None:
    means = np.array([[0.0, 0.01], [0.01, 0.0]])
    a, b = (each[:, None] + rng.normal(size=(2, 12)) for each in means)
    a += means[0][:, None] - a.mean(axis=1, keepdims=True)
    b += means[1][:, None] - b.mean(axis=1, keepdims=True)
    (change,) = changed_orders(SETS[:2], a, b, paired=True)
    assert change.significant is False
    assert change.differences == pytest.approx((0.01, -0.01))


@pytest.mark.parametrize(("sets", "clips", "paired"), [(2, 5, True), (2, 8, False), (6, 9, True), (25, 16, True)])
def test_a_swap_is_not_tested_where_no_test_could_show_it(sets: int, clips: int, paired: bool) -> None:
    up = np.repeat(np.arange(float(sets))[:, None], clips, axis=1)
    names = [(f"place_{n}",) for n in range(sets)]
    changes = changed_orders(names, up, -up, paired=paired)
    assert len(changes) == sets * (sets - 1) // 2
    assert {change.significant for change in changes} == {None}
    assert changes[0].differences[1] == -(sets - 1.0)


UNITS = make_candidate_groups(
    [
        Candidate("ankle", "rtibia", 0.9, 90.0, pair="each"),
        Candidate("pelvis", "lhipjoint", 0.0, 165.0),
        Candidate("head", "head", 1.0),
        Candidate("torso", "thorax"),
    ]
)
CLAIM = PublishedClaim("they suffice", "somebody", ("ankle", "pelvis"), among=("ankle", "pelvis", "head"), margin=0.1)
SUITED, OTHER, WHOLE = ("right_ankle", "left_ankle", "pelvis"), ("left_ankle", "pelvis", "head"), ("all",)


def costs(level: float, jitter: float = 0.01, clips: int = 8) -> Costs:
    return {f"clip_{n}": level + jitter * (-1) ** n for n in range(clips)}


def verdicts(found: dict[StationNames, Costs]) -> tuple[BenchmarkStatement, BenchmarkStatement]:
    return evaluate_claim(CLAIM, SUITED, OTHER, WHOLE, found, unit="deg", basis="on some clips")


def test_a_set_is_held_against_all_others_of_its_size_among_the_papers_trackers() -> None:
    suited, others, whole = sets_of_claim(CLAIM, UNITS)
    assert names_of_places(suited) == SUITED
    assert [names_of_places(one) for one in others] == [
        ("right_ankle", "left_ankle", "head"),
        ("right_ankle", "pelvis", "head"),
        ("left_ankle", "pelvis", "head"),
    ]
    assert names_of_places(whole) == ("right_ankle", "left_ankle", "pelvis", "head")  # the paper knows no torso


def test_the_rival_is_the_best_of_those_that_were_measured() -> None:
    found: dict[StationNames, Costs] = {("a",): costs(2.0), ("b",): costs(1.0), ("c",): {}}
    assert best_alternative([("a",), ("b",), ("c",)], found) == ("b",)
    assert best_alternative([("c",)], found) == ()


@pytest.mark.parametrize(
    ("suited", "other", "whole", "expected"),
    [
        (2.0, 3.0, 1.9, ("reproduced", "reproduced")),
        (2.0, 3.0, 1.0, ("reproduced", "not reproduced")),  # all together err much less
        (2.0, 1.5, 1.9, ("not reproduced", "reproduced")),  # another one errs less
        (2.0, 2.0, 2.0 / 1.1, ("same", "same")),
    ],
)
def test_both_halves_are_judged(suited: float, other: float, whole: float, expected: tuple[str, str]) -> None:
    found = {SUITED: costs(suited), OTHER: costs(other, -0.01), WHOLE: costs(whole, -0.01)}
    claims = verdicts(found)
    assert tuple(claim.verdict for claim in claims) == expected
    for claim in claims:
        assert ("on some clips" in claim.why) is (claim.verdict != "reproduced")


def test_too_few_clips_and_none_are_said() -> None:
    few = {SUITED: costs(1.0, clips=5), OTHER: costs(2.0, clips=5), WHOLE: costs(1.0, clips=5)}
    assert [claim.verdict for claim in verdicts(few)] == ["cannot tell", "cannot tell"]
    assert [claim.verdict for claim in verdicts({SUITED: costs(1.0)})] == ["not run", "not run"]


def test_the_limit_is_labelled_and_stands_beside_the_error_that_it_is_derived_from() -> None:
    _, suffices = verdicts({SUITED: costs(2.37), OTHER: costs(3.0), WHOLE: costs(1.98)})
    assert suffices.measured == "2.37 deg; limit 2.18 deg, 110% of 1.98 of all 1"
    missing = {**costs(1.98), "clip_0": None}
    _, suffices = verdicts({SUITED: {**costs(2.37), "clip_0": 99.0}, OTHER: costs(3.0), WHOLE: missing})
    assert suffices.measured.startswith("2.37 deg; limit 2.18 deg")
