"""Agreement of two rankings, on errors whose true order is known."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from scipy import stats

from harness.bench.ranking.agreement import ErrorsByUnit, RankingAgreement, compare_rankings
from harness.compare import MIN_UNITS, tau_b
from harness.core.arrays import Floats

MEANS = {"a": 1.0, "b": 2.0, "c": 3.0, "d": 4.0}


def errors(
    means: Mapping[str, float], units: int, rng: np.random.Generator, spread: float = 0.2, *, skewed: bool = False
) -> ErrorsByUnit:
    """Errors by item and performer: the mean, what is common to a performer, and noise of standard deviation 1."""
    sizes = ((1, units), (len(means), units))
    performers, own = (rng.exponential(size=size) - 1.0 if skewed else rng.normal(size=size) for size in sizes)
    table = np.array(list(means.values()))[:, None] + performers + spread * own
    return {
        item: {f"p{k}": float(value) for k, value in enumerate(row)} for item, row in zip(means, table, strict=True)
    }


def order(ranking: RankingAgreement, verdict: str) -> set[str]:
    return {pair.a + pair.b for pair in ranking.pairs if pair.verdict == verdict}


def test_the_same_order_of_distant_items_has_a_tau_of_one(rng: np.random.Generator) -> None:
    found = compare_rankings(errors(MEANS, 8, rng), errors(MEANS, 13, rng))
    assert (found.tau, found.low, found.high) == (1.0, 1.0, 1.0)
    assert order(found, "agree") == {"ab", "ac", "ad", "bc", "bd", "cd"}
    assert (len(found.builtin), len(found.real), found.reason) == (8, 13, "")
    assert list(found.means) == list("abcd")


def test_a_reversed_pair_is_named_with_the_better_item_of_built_in_motion_first(rng: np.random.Generator) -> None:
    found = compare_rankings(errors(MEANS, 12, rng), errors({"a": 1.0, "b": 3.0, "c": 2.0, "d": 4.0}, 12, rng))
    assert order(found, "contradict") == {"bc"}
    assert found.tau == found.low == found.high == pytest.approx(4.0 / 6.0)
    (pair,) = found.with_verdict("contradict")
    assert pair.simulated.mean is not None
    assert pair.device.mean is not None
    assert pair.simulated.mean < 0.0 < pair.device.mean


def test_a_pair_of_nearly_equal_items_widens_the_interval(rng: np.random.Generator) -> None:
    found = compare_rankings(errors(MEANS, 12, rng), errors(MEANS | {"c": 2.001}, 12, rng))
    assert order(found, "cannot tell") == {"bc"}
    assert found.low == pytest.approx(4.0 / 6.0)
    assert found.high == 1.0


@pytest.mark.parametrize(("builtin", "real"), [(12, MIN_UNITS - 1), (MIN_UNITS - 1, 12)])
def test_too_few_performers_of_either_side_decide_nothing(builtin: int, real: int, rng: np.random.Generator) -> None:
    found = compare_rankings(errors(MEANS, builtin, rng), errors(MEANS, real, rng))
    assert (found.tau, found.low, found.high) == (1.0, None, None)
    name = "built-in" if builtin < real else "real"
    assert found.reason == f"too few units: 5 {name} performers, of at least 6"
    assert {pair.verdict for pair in found.pairs} == {"cannot tell"}
    assert found.pairs[0].why == "too few performers: 5, of at least 6"
    assert set(found.enough) == {None}


def test_two_names_of_one_method_are_a_tie(rng: np.random.Generator) -> None:
    builtin, real = errors(MEANS, 8, rng), errors(MEANS, 8, rng)
    found = compare_rankings({**builtin, "e": builtin["d"]}, {**real, "e": real["d"]})
    assert order(found, "cannot tell") == {"de"}
    assert found.tau == pytest.approx(1.0)
    assert found.low == pytest.approx(0.8)
    assert found.high == 1.0
    assert found.enough[-1] is None


def test_items_that_are_equal_on_one_side_have_no_tau(rng: np.random.Generator) -> None:
    same = errors(MEANS, 8, rng)["a"]
    found = compare_rankings(dict.fromkeys("abcd", same), errors(MEANS, 8, rng))
    assert (found.tau, found.low) == (None, None)
    assert "only ties" in found.reason


def test_two_items_have_no_tau(rng: np.random.Generator) -> None:
    two = {"a": 1.0, "b": 2.0}
    found = compare_rankings(errors(two, 8, rng), errors(two, 8, rng))
    assert found.tau is None
    assert order(found, "agree") == {"ab"}
    assert "2 items, of at least 3" in found.reason


@pytest.mark.parametrize("side", ["built-in", "real"])
def test_a_method_that_failed_on_a_performer_is_left_out(side: str, rng: np.random.Generator) -> None:
    sides = {"built-in": errors(MEANS, 8, rng), "real": errors(MEANS, 8, rng)}
    sides[side] = {**sides[side], "b": {**sides[side]["b"], "p3": None}}
    found = compare_rankings(sides["built-in"], sides["real"])
    assert found.left_out == {"b": f"not measured on {side} motion of p3"}
    assert list(found.means) == ["a", "c", "d"]
    assert (found.tau, len(found.builtin), len(found.real)) == (1.0, 8, 8)


def test_nothing_measured_is_no_ranking() -> None:
    nothing = {item: dict.fromkeys(("p1", "p2")) for item in MEANS}
    found = compare_rankings(nothing, nothing)
    assert (found.tau, found.pairs, set(found.left_out)) == (None, (), set(MEANS))


def test_enough_performers_are_the_fewest_that_decide_a_pair(rng: np.random.Generator) -> None:
    """Held to SciPy's test: samples of the same mean and spread, with that many performers and with one fewer."""
    near = MEANS | {"b": 1.1}
    found = compare_rankings(errors(near, 12, rng), errors(near, 12, rng))
    enough = found.enough[[pair.a + pair.b for pair in found.pairs].index("ab")]
    assert enough is not None
    assert enough > 12

    def largest_p(count: int) -> float:
        z = (np.arange(count) - (count - 1) / 2.0) / np.std(np.arange(count), ddof=1)
        sides = (side for pair in found.pairs[:1] for side in (pair.device, pair.simulated))
        samples = []
        for side in sides:
            assert side.mean is not None
            assert side.high is not None
            deviation = (side.high - side.mean) / stats.t.ppf(0.975, 11) * np.sqrt(12)
            samples.append(side.mean + deviation * z)
        return max(float(stats.ttest_1samp(sample, 0.0, alternative="less").pvalue) for sample in samples)

    assert largest_p(enough) <= 0.05 / 6 < largest_p(enough - 1)


NEAR = (2.78, 3.1, 3.2, 3.27, 3.3, 3.9, 4.04, 6.14, 6.43)
"""Means of methods on real walking [deg]: some are far apart, some nearly equal."""


@pytest.mark.long
@pytest.mark.parametrize("skewed", [False, True])
@pytest.mark.parametrize("shuffled", [range(9), (4, 1, 6, 3, 0, 5, 2, 7, 8)])
def test_the_interval_contains_the_true_tau(shuffled: Sequence[int], skewed: bool, rng: np.random.Generator) -> None:
    """It does in at least 95 % of 100 studies, and at most 5 % call a pair reversed that is not."""
    means: Floats = np.array(NEAR)
    true = float(tau_b(means, means[list(shuffled)]))
    sides = [dict(zip("abcdefghi", values, strict=True)) for values in (means, means[list(shuffled)])]
    covered = false = 0
    for _ in range(100):
        found = compare_rankings(*(errors(side, 12, rng, 0.4, skewed=skewed) for side in sides))
        assert found.low is not None
        assert found.high is not None
        covered += found.low - 1e-9 <= true <= found.high + 1e-9
        reversed_pairs = found.with_verdict("contradict")
        false += any((sides[0][p.a] < sides[0][p.b]) == (sides[1][p.a] < sides[1][p.b]) for p in reversed_pairs)
    assert covered >= 95
    assert false <= 5


@pytest.mark.long
def test_percentiles_over_resampled_performers_are_no_interval(rng: np.random.Generator) -> None:
    """They contain a true tau of 1 in fewer than 60 of 100 studies with nearly equal items (nominal 95 %)."""
    side, covered = dict(zip("abcdefghi", NEAR, strict=True)), 0
    for _ in range(100):
        tables = [np.array([list(of.values()) for of in errors(side, 12, rng, 0.4).values()], float) for _ in range(2)]
        drawn = [table[:, rng.integers(0, 12, (300, 12))].mean(axis=2).T for table in tables]
        covered += bool(np.quantile(tau_b(drawn[0], drawn[1]), 0.975) >= 1.0 - 1e-9)
    assert covered < 60
