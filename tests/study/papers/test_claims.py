"""Claims: published figures, orders, non-inferiority, several parts, and Holm's correction over printed statements."""

from dataclasses import replace

import numpy as np
import pytest

from harness.results.findings import BenchmarkStatement, Verdict
from harness.study.papers.claims import (
    claim_all,
    claim_decreasing,
    claim_lower_error,
    claim_noninferior,
    claim_published_value,
    correct_claims,
)


def by_clip(values: np.ndarray) -> dict[str, float]:
    return {f"clip_{at}": float(value) for at, value in enumerate(values)}


def order(clips: int, gain: float = 1.0) -> BenchmarkStatement:
    """A claim whose differences all have the sign of `gain`."""
    more = np.linspace(5.0, 6.0, clips)
    return claim_lower_error("a < b", by_clip(more - gain * np.linspace(0.9, 1.1, clips)), by_clip(more))


@pytest.mark.parametrize(
    ("excess", "spread", "verdict"),
    [
        (0.05, 0.01, "reproduced"),  # the margin of 10 deg is 0.2
        (-1.0, 0.5, "reproduced"),
        (0.19, 0.2, "cannot tell"),
        (0.3, 0.01, "not reproduced"),
    ],
)
def test_noninferior_is_an_excess_whose_interval_ends_below_the_margin(
    excess: float, spread: float, verdict: Verdict, rng: np.random.Generator
) -> None:
    reference = rng.uniform(8.0, 12.0, 12)
    reference += 10.0 - reference.mean()
    noise = rng.normal(size=12)
    errors = reference + excess + spread * (noise - noise.mean())
    claim = claim_noninferior("suitable", by_clip(errors), by_clip(reference))
    assert claim.verdict == verdict
    assert claim.value == pytest.approx(0.2 - excess)
    assert (claim.low or 0.0) < (claim.value or 0.0) < (claim.high or 0.0)
    assert (claim.why == "") == (verdict == "reproduced")


def test_five_clips_are_too_few_for_noninferiority() -> None:
    claim = claim_noninferior("suitable", by_clip(np.ones(5)), by_clip(2.0 * np.ones(5)))
    assert (claim.verdict, claim.p) == ("cannot tell", None)
    assert "too few units" in claim.why
    assert claim_noninferior("suitable", {}, by_clip(np.ones(5))).verdict == "not run"


def test_a_claim_of_several_parts_is_as_good_as_its_worst() -> None:
    good, bad = order(8), order(8, -1.0)
    whole = claim_all("both", {"first": good, "second": bad})
    assert (whole.verdict, whole.value, whole.text) == ("not reproduced", bad.value, "both")
    assert whole.why.startswith("second: ")
    assert claim_all("both", {"first": good, "second": replace(good, p=0.9)}).p == 0.9


def test_one_part_that_is_refuted_refutes_the_claim() -> None:
    """Twelve clips: the first step is undecided, the second has the wrong sign on every clip."""
    noise = np.array([1.0, -1.1] * 6)
    series = {"1": by_clip(3.0 + noise), "2": by_clip(3.0 + 0.1 * noise), "3": by_clip(4.5 + 0.1 * noise)}
    (claim,) = correct_claims([claim_decreasing("more is better", series, "%")])
    assert claim.verdict == "not reproduced"
    assert claim.value == pytest.approx(-1.5, abs=0.01)
    assert claim.p == pytest.approx(2 * 2.0**-11)  # both steps count


@pytest.mark.parametrize(
    ("means", "verdict", "step"),
    [((3.0, 2.0, 1.0), "reproduced", ""), ((3.0, 1.0, 2.0), "not reproduced", "from 10 to 100 %")],
)
def test_errors_decrease_at_every_step(means: tuple[float, ...], verdict: Verdict, step: str) -> None:
    series = {
        name: by_clip(np.linspace(mean, mean + 0.1, 8)) for name, mean in zip(("1", "10", "100"), means, strict=True)
    }
    claim = claim_decreasing("more is better", series, "%")
    assert claim.verdict == verdict
    assert step in claim.why
    assert "with 1, 10, 100 %" in claim.measured
    assert claim_decreasing("more is better", {**series, "100": {}}, "%").verdict == "not run"


def test_a_p_is_two_over_all_flips_where_every_clip_agrees() -> None:
    assert order(8).p == pytest.approx(2.0**-7)
    assert order(5).p is None  # no interval, no test


def test_holm_takes_back_what_is_not_significant_among_the_printed_statements() -> None:
    """2^-7 times 6 is below 0.05, times 7 above it; twelve clips stand either test."""
    assert {claim.verdict for claim in correct_claims([order(8)] * 6)} == {"reproduced"}
    assert correct_claims([order(8)] * 6)[0].p_holm == pytest.approx(6.0 * 2.0**-7)
    taken_back = correct_claims([order(8)] * 7)
    assert {claim.verdict for claim in taken_back} == {"cannot tell"}
    assert "too few units: 8, and among 7 printed statements a difference needs 9" in taken_back[0].why
    assert {claim.verdict for claim in correct_claims([order(8, -1.0)] * 7)} == {"cannot tell"}
    assert {claim.verdict for claim in correct_claims([order(12)] * 40)} == {"reproduced"}


def test_enough_clips_that_disagree_are_not_significant() -> None:
    gains = np.array([*np.linspace(0.4, 1.6, 10), -0.2, -0.3])
    claim = claim_lower_error("a < b", by_clip(6.0 - gains), by_clip(np.full(12, 6.0)))
    assert claim.verdict == "reproduced"
    (first, *_) = correct_claims([claim] * 60)
    assert first.verdict == "cannot tell"
    assert "not significant among 60" in first.why


def test_a_family_is_the_printed_statements_of_one_reading() -> None:
    ours, literal = replace(order(8), reading="ours"), replace(order(8), reading="as printed")
    assert {claim.verdict for claim in correct_claims([ours] * 6 + [literal] * 6)} == {"reproduced"}
    derived = replace(order(8), kind="derived")
    claims = correct_claims([derived] * 20 + [order(8)] * 6 + [order(5)] * 20)
    assert {claim.verdict for claim in claims[:26]} == {"reproduced"}
    assert {claim.p_holm for claim in claims[:20] + claims[26:]} == {None}


def level(error: float, clips: int = 8) -> dict[str, float]:
    """Errors of this mean, which differ by 0.01 from clip to clip."""
    return {f"clip_{n}": error + 0.01 * (-1) ** n for n in range(clips)}


@pytest.mark.parametrize(
    ("mean", "verdict", "off"),
    [
        (2.52, "reproduced", "0 %"),
        (3.10, "reproduced", "+23 %"),
        (3.20, "not reproduced", "+27 %"),
        (1.95, "reproduced", "−23 %"),
        (1.85, "not reproduced", "−27 %"),
    ],
)
def test_a_published_figure_is_met_within_a_quarter(mean: float, verdict: Verdict, off: str) -> None:
    claim = claim_published_value("positions", 2.52, level(mean), comparable=True, why="other clips")
    assert (claim.verdict, claim.clips, claim.target) == (verdict, 8, "2.52 deg")
    assert claim.why.startswith(f"{off}, ")
    assert ("other clips" in claim.why) is (verdict == "not reproduced")
    assert claim.value == pytest.approx(mean)


def test_a_figure_without_results_or_of_other_motion_has_no_verdict() -> None:
    assert claim_published_value("a", 2.0, {}, comparable=True, why="").verdict == "not run"
    other = claim_published_value("a", 2.0, level(2.0), comparable=False, why="synthetic")
    assert (other.verdict, other.why, other.measured) == ("not comparable", "synthetic", "2.00 deg")


@pytest.mark.parametrize(
    ("less", "more", "verdict"),
    [(2.0, 3.0, "reproduced"), (3.0, 2.0, "not reproduced"), (2.0, 2.0, "same")],
)
def test_an_order_is_judged_by_the_paired_difference(less: float, more: float, verdict: Verdict) -> None:
    claim = claim_lower_error("a < b", level(less), level(more), why="a reason")
    assert claim.verdict == verdict
    assert claim.value == pytest.approx(more - less)
    assert claim.measured == f"{less:.2f} against {more:.2f} deg"
    assert ("a reason" in claim.why) is (verdict != "reproduced")
