"""What the code quotes of both papers, against the figures of the papers (docs/papers.md A6, B1, B6)."""

import re
from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.package_data import data_folder
from harness.core.skeleton import Skeleton
from harness.results.findings import PaperExperiment
from harness.stream import make_inputs
from harness.study.papers.bone_lengths import evaluate_bone_modes
from harness.study.papers.kim2012 import PAPER as KIM
from harness.study.papers.liu2011 import PAPER as LIU
from harness.study.papers.liu2011 import PUBLISHED_DEG
from harness.study.papers.paper import Paper
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.published_speed import KIM2012, LIU2011
from harness.study.placement.config import load_placement_study

SIX = ("left_hand", "right_hand", "left_ankle", "right_ankle", "head", "torso")
BOXING_DEG = {"1.25": (6, 6), "2.25": (6, 1), "2.52": (6, 0), "3.27": (3, 4)}
"""Error on boxing as printed [deg] -> number of positions and of orientations of the six trackers."""


def unmeasured(paper: Paper, name: str) -> PaperExperiment:
    """An experiment without results, whose texts quote the paper."""
    study = PaperStudy(Path("nowhere"), "builtin", 1, paper.plan("builtin", 1))
    return paper.experiments[name](study)


def test_errors_on_boxing_are_those_of_liu() -> None:
    assert [f"{value:.2f}" for value in PUBLISHED_DEG.values()] == list(BOXING_DEG)
    for inputs, (positions, orientations) in zip(PUBLISHED_DEG, BOXING_DEG.values(), strict=True):
        kept = make_inputs(inputs, SIX)
        assert (sum(kept.position), sum(kept.orientation)) == (positions, orientations)
    mixed = make_inputs(list(PUBLISHED_DEG)[-1], SIX)
    assert [s for s, used in zip(SIX, mixed.position, strict=True) if used] == ["left_ankle", "right_ankle", "torso"]
    assert [s for s, used in zip(SIX, mixed.orientation, strict=True) if used] == [
        *("left_hand", "right_hand", "head", "torso")
    ]


def test_texts_quote_the_same_errors() -> None:
    experiment = unmeasured(LIU, "boxing_inputs")
    assert re.findall(r"\d\.\d\d", experiment.question) == list(BOXING_DEG)
    quoted = {claim.target for claim in experiment.claims}
    assert quoted == {"1.25 < 2.25 deg", "2.25 < 2.52 deg", "2.52 < 3.27 deg", *(f"{deg} deg" for deg in BOXING_DEG)}


@pytest.mark.parametrize(("behaviour", "suitable"), [("walking", "RA+LA+PEL"), ("boxing", "RH+LH+PEL")])
def test_suitable_sets_are_those_of_kim(behaviour: str, suitable: str) -> None:
    """Fig. 3: both ankles and the pelvis for walking, both hands and the pelvis for boxing."""
    experiment = unmeasured(KIM, "sensors")
    assert re.search(rf"{re.escape(suitable)} (suitable )?for {behaviour}", experiment.question)
    texts = [
        claim.text
        for claim in experiment.claims
        if claim.text.startswith(f"{behaviour}, ") and claim.target == "called suitable"
    ]
    assert texts
    assert all(suitable in text for text in texts)


@pytest.mark.parametrize(("behaviour", "suitable"), [("walking", ("ankle", "pelvis")), ("boxing", ("hand", "pelvis"))])
def test_placement_studies_test_the_sets_of_kim(behaviour: str, suitable: tuple[str, ...]) -> None:
    (claim,) = load_placement_study(data_folder("scenarios") / "placement" / f"{behaviour}.toml").claim
    assert (claim.set, claim.among) == (suitable, ("hand", "ankle", "pelvis"))
    assert claim.text.startswith(f"{behaviour}: both {suitable[0]}s and the pelvis")


def test_speeds_and_databases_are_those_of_the_papers() -> None:
    frames = {"walking": 18_160, "boxing": 31_358, "jumping": 6_483, "golf": 2_339, "table_tennis": 7_582}
    assert (LIU2011.fps, LIU2011.latency_ms) == (35.0, 25.0)
    assert LIU2011.databases == {**{name: {name: count} for name, count in frames.items()}, "all together": frames}
    assert "at 35 frames" in LIU2011.statement
    assert "0.025 s" in LIU2011.statement
    assert f"{sum(frames.values()):,} frames" in LIU2011.statement
    assert KIM2012.fps == 80.0
    assert KIM2012.latency_ms is None
    assert KIM2012.databases == {
        name: {name: count} for name, count in {"boxing": 7_233, "table_tennis": 4_271, "walking": 1_317}.items()
    }
    assert "80 frames" in KIM2012.statement
    assert all(count in KIM2012.statement for count in ("7,233", "4,271", "1,317"))


def people(explained: float, rng: np.random.Generator) -> dict[str, Skeleton]:
    """Twelve people with equal tibias, whose lengths vary in six uncorrelated directions; five explain this share."""
    standard, tibia = standard_skeleton(), BONES.index("ltibia")
    others = [bone for bone in range(len(BONES)) if bone != tibia]
    directions = np.linalg.qr(rng.normal(size=(len(others), 6)))[0].T
    scores = np.linalg.qr(np.concatenate([np.ones((12, 1)), rng.normal(size=(12, 6))], axis=1))[0][:, 1:]
    size_m = 0.01 * np.sqrt([*(np.full(5, explained / 5.0)), 1.0 - explained])
    length_m = np.tile(standard.length_m, (12, 1))
    length_m[:, others] += (scores * size_m) @ directions
    return {
        f"person {n}": standard.with_bones(standard.bone_m * (row / standard.length_m)[:, None])
        for n, row in enumerate(length_m)
    }


@pytest.mark.parametrize(
    ("explained", "verdict"),
    [
        (0.9840, "not reproduced"),
        (0.9845, "not reproduced"),
        (0.9855, "reproduced"),
        (0.9900, "reproduced"),
        (0.9945, "reproduced"),
        (0.9955, "not reproduced"),
    ],
)
def test_about_99_percent_is_what_rounds_to_99(explained: float, verdict: str, rng: np.random.Generator) -> None:
    """Fig. 4 of Liu et al.: five modes explain about 99 %."""
    (claim,) = evaluate_bone_modes(people(explained, rng), "planted", measured=True, seed=1).claims
    assert claim.value == pytest.approx(100.0 * explained, abs=1e-6)
    assert claim.target == "99 %"
    assert "about 99 %" in claim.text
    assert claim.verdict == verdict
