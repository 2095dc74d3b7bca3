"""Paired differences: laws of the interval, the verdicts, few clips, equal clips, and how often the truth is held."""

import numpy as np
import pytest
from scipy import stats

from harness.compare.paired_statistics import (
    MIN_UNITS,
    PairedDifference,
    compare_paired,
    mean_interval,
)
from harness.core.arrays import Floats
from harness.errors import BadInput


def ends(found: PairedDifference) -> list[float]:
    assert found.low is not None
    assert found.high is not None
    return [found.low, found.high]


def errors(values: Floats) -> dict[str, float | None]:
    return {f"clip {n:02d}": float(value) for n, value in enumerate(values)}


@pytest.mark.parametrize("count", [6, 7, 12, 40])
def test_swapped_sides_mirror_the_interval_and_the_verdict(count: int, rng: np.random.Generator) -> None:
    for shift in (-3.0, 0.0, 0.4, 3.0):
        a, b = errors(rng.lognormal(size=count) + shift), errors(rng.lognormal(size=count))
        there, back = compare_paired(a, b), compare_paired(b, a)
        assert there.mean is not None
        assert there.low is not None
        assert there.high is not None
        assert there.low < there.mean < there.high
        assert back.mean == pytest.approx(-there.mean)
        assert ends(back) == pytest.approx([-end for end in reversed(ends(there))])
        turned = {"reproduced": "not reproduced", "not reproduced": "reproduced", "cannot tell": "cannot tell"}
        assert back.verdict == turned[there.verdict]
        assert there.verdict == (
            "reproduced" if there.low > 0 else "not reproduced" if there.high < 0 else "cannot tell"
        )


def test_what_both_sides_share_does_not_count(rng: np.random.Generator) -> None:
    """Clips that are hard for both sides widen nothing: the comparison is paired."""
    difficulty, off = rng.uniform(0.0, 50.0, 9), rng.normal(0.5, 0.1, 9)
    found = compare_paired(errors(difficulty + off), errors(difficulty))
    assert ends(found) == pytest.approx(mean_interval(off), abs=1e-9)
    assert found.verdict == "reproduced"


def test_an_interval_moves_and_grows_with_its_values(rng: np.random.Generator) -> None:
    values = rng.gamma(2.0, size=11)
    low, high = mean_interval(values)
    np.testing.assert_allclose(mean_interval(5.0 + 3.0 * values), [5.0 + 3.0 * low, 5.0 + 3.0 * high], atol=1e-9)
    assert low < values.mean() < high
    wider = mean_interval(values, level=0.99)
    assert wider[0] <= low
    assert wider[1] >= high


def test_the_same_errors_give_the_same_interval_in_any_order(rng: np.random.Generator) -> None:
    a, b = errors(rng.normal(size=8)), errors(rng.normal(size=8))
    assert compare_paired(a, b) == compare_paired(dict(reversed(a.items())), b)


def test_only_clips_of_both_sides_count() -> None:
    a = {"x": 1.0, "y": 2.0, "gone": None, "mine": 9.0}
    b = {"y": 1.0, "x": 0.5, "gone": 1.0, "theirs": 9.0}
    found = compare_paired(a, b)
    assert found.units == ("x", "y")
    assert found.mean == 0.75


@pytest.mark.parametrize("count", range(MIN_UNITS))
def test_few_clips_tell_nothing(count: int) -> None:
    found = compare_paired(errors(np.full(count, 9.0) + np.arange(count)), errors(np.zeros(count)))
    assert found.low is found.high is None
    assert found.verdict == ("cannot tell" if count else "not run")
    assert ("too few units" in found.why) if count else ("no unit" in found.why)


@pytest.mark.parametrize(
    ("difference", "verdict"), [(0.0, "cannot tell"), (0.1, "reproduced"), (-0.1, "not reproduced")]
)
def test_equal_differences_have_an_interval_of_no_width(difference: float, verdict: str) -> None:
    b = np.arange(8.0)
    found = compare_paired(errors(b + difference), errors(b))
    assert found.verdict == verdict
    assert ends(found) == pytest.approx([difference, difference], abs=1e-12)


@pytest.mark.parametrize(
    "values", [[0, 0, 0, 0, 0, 1], [1, 1, 1, 1, 1, 1 + 1e-6], [-1, 1, -1, 1, -1, 1], [0] * 30 + [1]]
)
def test_awkward_differences_have_finite_intervals(values: list[float]) -> None:
    low, high = mean_interval(np.array(values, float))
    assert low <= np.mean(values) <= high
    assert high - low < 2.0 * max(np.ptp(values), 1e-3)


def test_what_was_not_measured_is_none_and_never_nan() -> None:
    with pytest.raises(BadInput, match="clip 01"):
        compare_paired(errors(np.array([1.0, np.nan])), errors(np.zeros(2)))


@pytest.mark.parametrize("count", [6, 12, 100])
def test_the_interval_is_never_narrower_than_students(count: int, rng: np.random.Generator) -> None:
    values = rng.normal(size=count)
    half = stats.t.ppf(0.975, count - 1) * stats.sem(values)
    low, high = mean_interval(values)
    assert low <= values.mean() - half < values.mean() + half <= high
    assert high - low < 2.6 * half


def test_the_interval_is_longer_on_the_side_of_the_tail() -> None:
    """Of a skewed population a sample often lacks the tail, so that the mean may lie far above."""
    low, high = mean_interval(np.exp(np.linspace(-1.5, 1.5, 12)))
    mean = float(np.exp(np.linspace(-1.5, 1.5, 12)).mean())
    assert high - mean > 1.3 * (mean - low)
