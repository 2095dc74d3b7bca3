"""The verdict of a trust study in words, for every outcome."""

import pytest

from harness.errors import Outcome
from harness.report.lab.trust_content import TrustReport
from harness.report.lab.trust_wording import (
    correlation_text,
    count_pairs,
    metric_title,
    side_interval,
    side_text,
    sort_equivalences,
    sort_pairs,
    verdict_sentence,
)
from harness.results.trust_findings import RankCorrelation, SideDifference
from tests.report.fabricate_trust import empty_trust, made_up_trust, trust_of

CANNOT = "It cannot be told whether the simulation ranks methods as the device does: "


@pytest.mark.parametrize(
    ("report", "sentence"),
    [
        (
            made_up_trust(),
            "The simulation contradicts the device in 1 of 6 pairs of methods (local_pca against dynamic_map) and "
            "differs from the device beyond the margin in 1 of 4 metrics (dynamic_map joint angle error).",
        ),
        (
            trust_of(Outcome.REGRESSED, pairs=made_up_trust().findings.pairs[:1]),
            "The simulation differs from the device beyond the margin in 1 of 4 metrics (dynamic_map joint angle "
            "error).",
        ),
        (
            trust_of(Outcome.REGRESSED, equivalences=()),
            "The simulation contradicts the device in 1 of 6 pairs of methods (local_pca against dynamic_map).",
        ),
        (
            trust_of(Outcome.PASS, pairs=made_up_trust().findings.pairs[:2]),
            "The simulation ranks methods as the device does: of 2 pairs of methods on 8 clips, none contradicts.",
        ),
        (
            trust_of(Outcome.INCOMPLETE, failures={"ik on walking": "it crashed"}),
            "The study is incomplete: 1 cell failed (ik on walking).",
        ),
        (trust_of(Outcome.NOT_COMPARABLE), f"{CANNOT}1 of 6 pairs of methods on 8 clips is undecided."),
        (empty_trust(), f"{CANNOT}nothing was compared."),
    ],
)
def test_each_outcome_has_its_sentence(report: TrustReport, sentence: str) -> None:
    assert verdict_sentence(report.findings) == sentence


def test_contradictions_come_first() -> None:
    found = made_up_trust().findings
    assert count_pairs(found.pairs) == {"contradict": 1, "cannot tell": 1, "agree": 4}
    assert [pair.verdict for pair in sort_pairs(found.pairs)][:3] == ["contradict", "cannot tell", "agree"]
    verdicts = [row.verdict for row in sort_equivalences(found.equivalences)]
    assert verdicts == ["beyond the margin", "cannot tell", "equivalent", "equivalent"]


def test_metrics_have_names_and_units() -> None:
    assert metric_title("joint_angle_mean_deg") == "joint angle error [deg]"
    assert metric_title("mine") == "mine"


def test_a_correlation_has_its_interval_or_its_reason() -> None:
    assert correlation_text(RankCorrelation("tau", -0.5, -0.9, 0.2)) == "Tau −0.50 (−0.90 to 0.20)"
    assert correlation_text(RankCorrelation("tau", 1.0, None, None)) == "Tau 1.00"
    assert correlation_text(RankCorrelation("tau", None, None, None, "2 arms")) == "Tau: not measured (2 arms)"


def test_a_side_without_clips_has_dashes() -> None:
    none = SideDifference(None, None, None, None)
    assert (side_text(none), side_interval(none)) == ("–", "–")
    few = SideDifference(1.234, None, None, None)
    assert (side_text(few), side_interval(few)) == ("+1.2", "–")
    known = SideDifference(-0.7, -1.1, -0.3, 0.01)
    assert (side_text(known), side_interval(known)) == ("−0.70", "−1.10 to −0.30")
