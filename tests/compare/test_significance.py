"""Sign flips, Holm's correction and verdicts: laws, cases worked out by hand, and what few clips can show."""

import itertools

import numpy as np
import pytest

from harness.compare import significance
from harness.compare.significance import (
    SignificanceResult,
    decide_verdicts,
    holm,
    sign_flip_max_p,
    sign_flip_p,
    smallest_possible_p,
)
from harness.core.arrays import Floats
from harness.core.seeds import generator


def by_hand(difference: Floats) -> float:
    """Every flip, one after another."""
    flips = itertools.product((-1.0, 1.0), repeat=len(difference))
    means = [abs(sum(sign * value for sign, value in zip(flip, difference, strict=True))) for flip in flips]
    return float(np.mean([mean >= abs(difference.sum()) - 1e-9 for mean in means]))


@pytest.mark.parametrize("count", [1, 2, 6, 9])
def test_p_is_the_share_of_flips_as_far_from_zero(count: int, rng: np.random.Generator) -> None:
    for shift in (0.0, 0.5, 3.0):
        difference = rng.normal(size=count) + shift
        assert sign_flip_p(difference) == pytest.approx(by_hand(difference), abs=1e-12)


@pytest.mark.parametrize("count", [6, 17])
def test_the_corrected_p_of_lines_with_common_flips(count: int, rng: np.random.Generator) -> None:
    lines = [rng.normal(size=count), rng.normal(size=count) + 1.0, np.zeros(count), 100.0 + rng.normal(size=count)]
    corrected = sign_flip_max_p(lines)
    alone = [sign_flip_p(line) for line in lines]
    assert sign_flip_max_p(lines[1:2]) == pytest.approx(alone[1:2])
    assert all(p >= each - 1e-12 for p, each in zip(corrected, alone, strict=True))
    assert corrected[2] == 1.0
    assert corrected[3] == pytest.approx(
        alone[3]
    )  # of the largest statistic: 2/64 of six units, which Holm would double
    again = sign_flip_max_p([10.0 * line for line in lines])
    assert again == pytest.approx(corrected)


@pytest.mark.parametrize(
    ("difference", "p"),
    [
        ([0.1] * 6, 2 / 64),  # none but all of one sign
        ([0.1, 0.2, 0.3, 0.4, 0.5, 0.6], 2 / 64),
        ([0.1, 0.1, 0.1, 0.1, 0.1, -0.1], 14 / 64),  # seven ways each to have at most one of the other sign
        ([0.0, 0.0, 0.3, 0.3, 0.3, 0.3], 2 / 16),  # zeros have no sign
        ([0.0] * 6, 1.0),
    ],
)
def test_ties_count_as_found(difference: list[float], p: float) -> None:
    assert sign_flip_p(np.array(difference)) == pytest.approx(p, abs=1e-12)


@pytest.mark.parametrize("count", [8, 16, 17, 24])
def test_p_does_not_know_sides_units_or_order(count: int, rng: np.random.Generator) -> None:
    difference = rng.normal(0.3, 1.0, count)
    assert sign_flip_p(-difference) == sign_flip_p(difference) == sign_flip_p(1e-3 * difference)
    if count <= 16:
        assert sign_flip_p(difference[::-1]) == sign_flip_p(difference)


def test_many_clips_are_drawn_as_exactly_as_few_are_counted(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [rng.normal(shift, 1.0, 15) for shift in (0.1, 0.4, 0.7)]
    exact = [sign_flip_p(line) for line in lines]
    monkeypatch.setattr(significance, "_EXACT_UNITS", 10)
    significance._cached_sign_flips.cache_clear()
    drawn = [sign_flip_p(line) for line in lines]
    significance._cached_sign_flips.cache_clear()
    np.testing.assert_allclose(drawn, exact, atol=4.0 * np.sqrt(0.25 / 20_000))
    assert sign_flip_p(np.ones(40)) == 1 / 20_001


def test_flips_that_are_drawn_in_parts_are_those_that_are_drawn_at_once(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = rng.normal(0.2, 1.0, 80)
    flips = 1.0 - 2.0 * generator(0, "sign flips", 80).integers(0, 2, (20_000, 80))
    at_least = np.count_nonzero(np.abs(flips @ line) >= abs(line.sum()))
    assert sign_flip_p(line) == pytest.approx((1 + at_least) / 20_001, abs=1e-12)
    np.testing.assert_array_equal(np.concatenate(list(significance._sign_flips(80))), flips)


def test_least_p_is_that_of_all_on_one_side(rng: np.random.Generator) -> None:
    difference = rng.normal(size=9)
    assert smallest_possible_p(difference) == sign_flip_p(np.abs(difference)) == 2 / 2**9
    assert smallest_possible_p(difference) <= sign_flip_p(difference)


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.5]) == [1.0, 1.0]
    assert holm([]) == []


def test_holm_keeps_the_order_and_lies_between_p_and_bonferroni(rng: np.random.Generator) -> None:
    for count in (1, 3, 20):
        p = rng.random(count) ** 3
        corrected = np.array(holm(p.tolist()))
        assert (np.diff(corrected[np.argsort(p)]) >= 0.0).all()
        assert (corrected >= p).all()
        assert (corrected <= np.minimum(1.0, count * p) + 1e-15).all()


SCATTER: Floats = generator(1, "scatter").normal(size=12)
SCATTER -= SCATTER.mean()


def told(difference: Floats, margin: float, beside: int = 0) -> SignificanceResult:
    """Of a line that is judged beside so many others in which nothing is found."""
    others = [np.array([1.0, -1.0] * 4)] * beside
    return decide_verdicts([difference, *others], [margin, *[9.0] * beside])[0]


@pytest.mark.parametrize(
    ("difference", "verdict", "why"),
    [
        (0.5 + 0.1 * SCATTER, "worse", "larger than the margin"),
        (-0.5 + 0.1 * SCATTER, "better", "larger than the margin"),
        (0.02 * SCATTER, "same", "within the margin"),
        (np.zeros(12), "same", "within the margin"),
        (0.1 + 0.01 * SCATTER, "same", "within the margin"),  # surely a difference, of no importance
        (0.18 + 0.1 * SCATTER, "cannot tell", "perhaps by more"),
        (0.5 * SCATTER, "cannot tell", "contains zero"),
        (0.5 + 0.01 * SCATTER[:5], "cannot tell", "too few units: 5, of at least 6"),
        (np.zeros(0), "cannot tell", "too few units: 0"),
        (np.zeros(5), "same", "no unit differs"),
        (np.zeros(1), "same", "no unit differs"),
        (np.array([1e-9]), "cannot tell", "too few units: 1"),
        (0.02 * SCATTER[:5], "same", "within the margin"),
        (0.1 + 0.01 * SCATTER[:3], "same", "within the margin"),
        (0.5 * SCATTER[:5], "cannot tell", "too few units: 5"),
        (np.array([0.1999, 0.1998]), "cannot tell", "too few units: 2"),
    ],
)
def test_verdicts(difference: Floats, verdict: str, why: str) -> None:
    found = told(difference, margin=0.2)
    assert (found.verdict, found.p is None) == (verdict, len(difference) < 6)
    assert why in found.why


@pytest.mark.parametrize("count", [2, 3, 5])
def test_few_clips_are_seldom_called_the_same_when_the_true_difference_is_the_margin(count: int) -> None:
    """The interval is exact for normal differences, so that 2.5 % of them lie below a true mean at the margin."""
    draws = generator(1, "few clips", count).normal(1.0, 0.2, (4_000, count))
    same = [result.verdict == "same" for result in decide_verdicts(list(draws), [1.0] * len(draws))]
    assert np.mean(same) == pytest.approx(0.025, abs=4.0 * np.sqrt(0.025 * 0.975 / len(draws)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "least", "most"),
    [("normal", 0.02, 0.03), ("t3", 0.01, 0.03), ("worse tail", 0.06, 0.13), ("better tail", 0.0, 0.02)],
)
@pytest.mark.parametrize("count", [2, 3, 5])
def test_how_often_few_clips_are_called_the_same_at_the_margin(
    name: str, least: float, most: float, count: int
) -> None:
    """The table of docs/notes/statistics.md; the standard deviation is a tenth of the margin."""
    rng, shape = generator(1, "at the margin", name, count), (20_000, count)
    draws = {
        "normal": rng.normal(size=shape),
        "t3": rng.standard_t(3, size=shape) / np.sqrt(3.0),
        "worse tail": rng.exponential(size=shape) - 1.0,
        "better tail": 1.0 - rng.exponential(size=shape),
    }[name]
    results = decide_verdicts(list(1.0 + 0.1 * draws), [1.0] * len(draws))
    assert least <= np.mean([result.verdict == "same" for result in results]) <= most


def test_the_interval_of_few_clips_by_hand() -> None:
    """Mean 2, standard deviation 1, three values: t = 4.302653 (tables), so 2 -+ 4.302653 / sqrt(3)."""
    found = told(np.array([1.0, 2.0, 3.0]), 9.0)
    assert (found.low, found.high) == pytest.approx((2.0 - 2.484138, 2.0 + 2.484138), abs=1e-5)


def test_lines_that_are_not_decided_count_in_the_correction() -> None:
    clear: Floats = 1.0 + 0.01 * np.arange(8.0)
    lines = [clear, *[np.array([1.0, -1.0] * 4)] * 9]
    (alone,), (among,) = decide_verdicts([clear], [0.1]), decide_verdicts(lines, [0.1] * 10, [0])
    assert (alone.verdict, among.verdict) == ("worse", "cannot tell")
    assert among == decide_verdicts(lines, [0.1] * 10)[0]


def test_six_clips_can_show_nothing_among_many_lines() -> None:
    clear: Floats = 1.0 + 0.01 * np.arange(6.0)
    assert told(clear, 0.1).verdict == "worse"
    found = told(clear, 0.1, beside=1)
    assert (found.verdict, found.p_holm) == ("cannot tell", 2 * 2 / 64)
    assert "6, and among 2 lines a difference needs 7" in found.why


def test_lines_without_any_difference_do_not_count_for_the_others() -> None:
    clear: Floats = 1.0 + 0.01 * np.arange(6.0)
    found = decide_verdicts([clear, np.zeros(6), np.zeros(8)], [0.1] * 3)
    assert [line.verdict for line in found] == ["worse", "same", "same"]
    assert [line.p_holm for line in found] == [2 / 64, 1.0, 1.0]


def test_sides_exchanged_give_the_opposite_verdict(rng: np.random.Generator) -> None:
    opposite = {"worse": "better", "better": "worse"}
    lines = [rng.normal(shift, 0.1, 9) for shift in (-0.4, -0.1, 0.0, 0.4)]
    there, back = decide_verdicts(lines, [0.05] * 4), decide_verdicts([-line for line in lines], [0.05] * 4)
    for one, other in zip(there, back, strict=True):
        assert other.verdict == opposite.get(one.verdict, one.verdict)
        assert one.low == pytest.approx(-(other.high or 0.0))
        assert one.p_holm == other.p_holm
    assert {"worse", "better"} < {line.verdict for line in there}
