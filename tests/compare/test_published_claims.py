"""Verdicts on a paper's figures and orders, by hand-worked errors."""

import pytest

from harness.compare.claims import claim_lower_error, claim_published_value
from harness.results.benchmark_statement import Verdict


def level(error: float, clips: int = 8) -> dict[str, float]:
    """Errors of this mean, which differ by 0.01 from clip to clip."""
    return {f"clip_{n}": error + 0.01 * (-1) ** n for n in range(clips)}


@pytest.mark.parametrize(
    ("mean", "verdict", "off"),
    [
        (2.52, "reproduced", "+0 %"),
        (3.10, "reproduced", "+23 %"),
        (3.20, "not reproduced", "+27 %"),
        (1.95, "reproduced", "-23 %"),
        (1.85, "not reproduced", "-27 %"),
    ],
)
def test_a_published_figure_is_met_within_a_quarter(mean: float, verdict: Verdict, off: str) -> None:
    claim = claim_published_value("positions", 2.52, level(mean), comparable=True, why="other clips")
    assert (claim.verdict, claim.clips, claim.target) == (verdict, 8, "2.52 deg")
    assert claim.why.startswith(off.replace(" ", ""))
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
