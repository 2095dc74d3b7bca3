"""What it means that a set of trackers suffices, on errors whose answer is known."""

import pytest

from harness.results.benchmark_statement import BenchmarkStatement
from harness.results.placement_findings import StationNames
from harness.study.placement.candidates import Candidate, make_candidate_groups
from harness.study.placement.config import PublishedClaim
from harness.study.placement.published_claims import best_alternative, evaluate_claim, sets_of_claim
from harness.study.placement.ranking import Costs
from harness.study.placement.search import names_of_places

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
