"""Candidates: what a study's tables stand for, the law of mirrored places, and what nobody can wear."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import locate_mount
from harness.core import rotations
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, UnknownName
from harness.results.findings import CandidatePlace
from harness.study.placement.candidates import (
    Candidate,
    CandidateGrid,
    Pair,
    body_side,
    make_candidate_groups,
    mirror_place,
    opposite_bone,
    placement_fault,
    select_groups,
    station_set,
    to_mount,
)

STANDARD = standard_skeleton()
MIRROR = np.array([1.0, -1.0, 1.0])
ANKLE = Candidate("ankle", "rtibia", 0.9, 90.0, pair="each")
PELVIS = Candidate("pelvis", "lhipjoint", 0.0, 165.0)


def skewed(seed: int) -> Skeleton:
    """Every bone of another length and direction than the standard one, the left side unlike the right."""
    rng = generator(seed, "skewed")
    turned = rotations.rotate(rotations.exp(rng.normal(scale=0.15, size=(24, 3))), STANDARD.bone_m)
    return STANDARD.with_bones(rng.uniform(0.8, 1.2, size=(24, 1)) * turned)


def in_a_mirror(skeleton: Skeleton) -> Skeleton:
    return skeleton.with_bones(skeleton.bone_m[[skeleton.index(opposite_bone(b)) for b in skeleton.names]] * MIRROR)


@pytest.mark.parametrize("body", [STANDARD, skewed(1), skewed(2)], ids=["standard", "skewed", "skewed otherwise"])
def test_a_mirrored_place_is_the_mirror_image_of_its_place(body: Skeleton, rng: np.random.Generator) -> None:
    """On a body and on that body in a mirror: same point of the skin, same axes outward and along the bone."""
    image = in_a_mirror(body)
    for bone, along, around_deg in zip(
        3 * BONES, rng.uniform(0.0, 1.0, 72), rng.uniform(-180.0, 180.0, 72), strict=True
    ):
        side = body_side(bone, along)
        here = CandidatePlace(f"{side}_one" if side else "one", bone, along, around_deg, 0.02, side)
        there = mirror_place(here)
        assert mirror_place(there) == here
        if placement_fault(here, body):
            assert placement_fault(there, image)
            continue
        (point_m, turn), (image_m, image_turn) = (
            locate_mount(body, to_mount(here)),
            locate_mount(image, to_mount(there)),
        )
        np.testing.assert_allclose(image_m, MIRROR * point_m, atol=1e-9)
        for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)):
            one, other = (rotations.rotate(each, np.array(axis)) for each in (turn, image_turn))
            np.testing.assert_allclose(other, MIRROR * one, atol=1e-9)


def test_the_standard_body_is_its_own_mirror_image() -> None:
    np.testing.assert_allclose(in_a_mirror(STANDARD).bone_m, STANDARD.bone_m, atol=1e-12)


@pytest.mark.parametrize(
    ("pair", "names"),
    [
        ("", [["ankle"]]),
        ("each", [["right_ankle"], ["left_ankle"]]),
        ("together", [["right_ankle", "left_ankle"]]),
    ],
)
def test_a_pair_is_worn_together_or_each_by_itself(pair: Pair, names: list[list[str]]) -> None:
    for bone, around_deg in (("rtibia", 90.0), ("ltibia", -90.0)):  # whichever side the table names
        units = make_candidate_groups([Candidate("ankle", bone, 0.9, around_deg, pair=pair)])
        assert [[place.name for place in unit] for unit in units] == names
        if pair:
            sides = {place.name: (place.bone, place.around_deg, place.side) for unit in units for place in unit}
            assert sides == {"right_ankle": ("rtibia", 90.0, "right"), "left_ankle": ("ltibia", -90.0, "left")}


def test_a_grid_has_a_candidate_for_each_combination() -> None:
    units = make_candidate_groups([CandidateGrid(("rtibia", "head"), (0.5, 0.75), (0.0, 90.0))])
    assert [unit[0].name for unit in units[:4]] == ["rtibia_50_0", "rtibia_50_90", "rtibia_75_0", "rtibia_75_90"]
    assert len(units) == 8
    paired = make_candidate_groups([CandidateGrid(("lfemur",), (0.5,), (-90.0,), pair="together")])
    assert [place.name for place in paired[0]] == ["right_femur_50_-90", "left_femur_50_-90"]
    assert [(place.bone, place.around_deg) for place in paired[0]] == [("rfemur", 90.0), ("lfemur", -90.0)]


def test_places_that_nobody_can_wear_are_named() -> None:
    bone_m = np.array(STANDARD.bone_m)
    bone_m[STANDARD.index("rwrist")] = 0.0
    tables: list[Candidate | CandidateGrid] = [
        ANKLE,
        CandidateGrid(("rtibia", "rwrist"), (0.5,), (0.0, 90.0)),
        Candidate("far", "head", 1.5),
    ]
    with pytest.raises(BadInput, match="3 of 7 candidates are impossible") as refusal:
        make_candidate_groups(tables, STANDARD.with_bones(bone_m))
    for named in ("rwrist_50_0 (Station", "rwrist_50_90 (Station", "which has no length", "far (along = 1.5"):
        assert named in str(refusal.value)
    assert "rtibia_50_0" not in str(refusal.value)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ([], "No candidates"),
        ([ANKLE, replace(ANKLE, along=0.5)], "Duplicate names of candidates: 'left_ankle', 'right_ankle'"),
        ([replace(PELVIS, pair="each")], "in the middle of the body"),
        ([replace(ANKLE, name="left_ankle")], "is on rtibia"),
    ],
)
def test_candidates_that_make_no_sense_are_refused(tables: list[Candidate], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        make_candidate_groups(tables)


def test_a_bone_that_does_not_exist_is_refused_with_a_suggestion() -> None:
    with pytest.raises(UnknownName, match="rtibia"):
        make_candidate_groups([Candidate("ankle", "rtibbia")])


def test_sets_are_named_by_candidates_or_pairs_in_the_order_of_the_candidates() -> None:
    units = make_candidate_groups([ANKLE, PELVIS])
    assert [place.name for place in station_set(select_groups(["pelvis", "ankle"], units, "x"), units)] == [
        "right_ankle",
        "left_ankle",
        "pelvis",
    ]
    assert select_groups([], units, "x") == units
    with pytest.raises(BadInput, match=r"greedy.base has 'knee'.*candidates are right_ankle, left_ankle, pelvis"):
        select_groups(["knee"], units, "greedy.base")
