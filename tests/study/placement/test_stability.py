"""How alike two conditions rank sets, by a figure that is Kendall's, and how sure it is."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.results.placement_findings import StationNames
from harness.study.placement.stability import (
    ConditionCosts,
    changed_orders,
    rank_agreements,
    rank_by_condition,
)

CLIPS = tuple(f"clip_{n}" for n in range(8))
SETS: tuple[StationNames, ...] = tuple((name,) for name in "abcdef")


def elsewhere(name: str, means: Floats, noise: Floats | float = 0.0, clips: tuple[str, ...] = CLIPS) -> ConditionCosts:
    table = np.asarray(means)[:, None] + noise * np.ones((1, len(clips)))
    rows = zip(SETS, table.tolist(), strict=True)
    return ConditionCosts(name, "noise", {worn: dict(zip(clips, row, strict=True)) for worn, row in rows})


def test_the_same_order_agrees_and_the_reverse_disagrees() -> None:
    up = np.arange(6.0)
    each = [elsewhere("own", up), elsewhere("alike", 10.0 + 3.0 * up), elsewhere("reversed", -up, clips=CLIPS[:7])]
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
    few = [elsewhere(name, np.arange(6.0), clips=CLIPS[:3]) for name in ("own", "other")]
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
