"""A question without a file: its clips, its places, what it costs, and what is refused."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.core.split import performer_of
from harness.errors import BadInput, UnknownName
from harness.mocap import open_motion_source
from harness.study.placement.plan import plan_study
from harness.study.placement.question import (
    EXAMPLE_FRAMES,
    PlacementQuestion,
    QuestionStudy,
    list_sets,
    question_study,
)
from harness.study.placement.question_clips import FRESH_PERFORMERS, builtin_units

TRIPLES = PlacementQuestion(3, 3, ("table_tennis",))


def performers(units: Mapping[str, tuple[str, ...]]) -> set[str | None]:
    return {performer_of(clip) for clips in units.values() for clip in clips}


def test_performers_who_are_chosen_on_held_out_and_learnt_from_are_different_people() -> None:
    clips = question_study(TRIPLES, None).clips
    groups = [performers(clips.pool), performers(clips.held_out), {performer_of(clip) for clip in clips.examples}]
    assert list(map(len, groups)) == [48, 32, 16]
    assert len(set().union(*groups, FRESH_PERFORMERS)) == 48 + 32 + 16 + 32
    assert set(clips.pool) == {f"performer {who}" for who in groups[0]}
    for units in (clips.pool, clips.held_out):
        for unit, (tested,) in units.items():
            (own,) = clips.own_examples[unit]
            assert own != tested
            assert performer_of(own) == performer_of(tested)
    source = open_motion_source("builtin", None, seed=1, rate_hz=None)
    for clip in (*clips.test, *clips.examples, *builtin_units(FRESH_PERFORMERS, ("golf",))["performer p128"]):
        source.check(clip)


def test_with_split_subject_methods_learn_from_other_performers_alone() -> None:
    known, new = (question_study(replace(TRIPLES, split=split), None) for split in ("sequence", "subject"))
    assert new.clips.own_examples == {}
    assert new.scenario.motion.split == "subject"
    assert (new.clips.pool, new.clips.examples) == (known.clips.pool, known.clips.examples)


def test_the_effort_changes_no_clip_and_no_example() -> None:
    studies = [question_study(replace(TRIPLES, effort=effort), None) for effort in ("quick", "thorough")]
    assert studies[0].clips == studies[1].clips
    assert studies[0].scenario == studies[1].scenario


def test_every_performer_does_every_behaviour() -> None:
    asked = question_study(replace(TRIPLES, behaviours=("walking", "boxing"), clips=5), None)
    assert len(asked.clips.pool) == 5
    assert all([clip.split("_")[0] for clip in unit] == ["walking", "boxing"] for unit in asked.clips.pool.values())
    assert {clip.split("_")[0] for clip in asked.clips.examples} == {"walking", "boxing"}
    plan = plan_study(asked.study, lambda name: asked.scenario, None)
    assert plan.units(plan.scenario) == tuple(sorted(asked.clips.pool))
    assert plan.held_out is not None
    assert plan.held_out.motion.behaviours == ("walking", "boxing") * 32
    assert asked.question.name == "walking_boxing_3"
    assert asked.question.title == "Where are 3 stations worn for walking and boxing?"


def sets(asked: QuestionStudy, size: int) -> set[frozenset[str]]:
    groups = asked.study.groups()
    return {frozenset(place.name for place in stations) for stations in list_sets(size, groups, asked.base)}


def test_stations_that_are_worn_anyway_are_in_every_set() -> None:
    asked = question_study(replace(TRIPLES, places=("hand", "pelvis"), base=("head",)), None)
    assert sets(asked, 3) == {
        frozenset({"head", "right_hand", "left_hand"}),
        frozenset({"head", "right_hand", "pelvis"}),
        frozenset({"head", "left_hand", "pelvis"}),
    }
    assert asked.question.title.endswith("worn for table tennis, head among them?")


def test_with_symmetric_both_sides_are_worn_or_neither() -> None:
    asked = question_study(replace(TRIPLES, places=("hand", "pelvis", "ankle"), symmetric=True), None)
    assert sets(asked, 3) == {
        frozenset({"pelvis", "right_hand", "left_hand"}),
        frozenset({"pelvis", "right_ankle", "left_ankle"}),
    }


def test_costs_are_of_both_sides_unless_a_side_is_named() -> None:
    question = replace(TRIPLES, places=("hand", "head"), costs={"left_hand": 3.0, "hand": 2.0})
    asked = question_study(replace(question, fewest=1), None)
    assert asked.station_costs == {"head": 1.0, "right_hand": 2.0, "left_hand": 3.0}
    assert asked.price(("head", "left_hand")) == 4.0
    assert question_study(TRIPLES, None).station_costs == {}


def test_the_line_and_the_physics_are_those_that_are_asked_for() -> None:
    asked = question_study(replace(TRIPLES, baud=19200, constellation="hall"), None)
    assert asked.scenario.tracker.baud == 19200
    assert asked.scenario.physics is not None
    assert asked.scenario.physics.constellation.name == "hall"
    plan = plan_study(asked.study, lambda name: asked.scenario, None)
    assert plan.rate_hz(3) == pytest.approx(19200 / (10 * 38 * 3))
    assert question_study(TRIPLES, None).scenario.physics is None


@pytest.mark.parametrize(
    ("changes", "second"),
    [
        ({}, "ik"),
        ({"method": "ik"}, "expert_map"),
        ({"second_method": "ridge"}, "ridge"),
        ({"second_method": "none"}, ""),
    ],
)
def test_the_second_method_is_another_one(changes: dict[str, Any], second: str) -> None:
    assert replace(TRIPLES, **changes).second == second


@pytest.mark.parametrize(
    ("changes", "error", "said"),
    [
        ({"behaviours": ("table_tenis",)}, UnknownName, "Did you mean 'table_tennis'"),
        ({"places": ("hed",)}, UnknownName, "Did you mean 'head'"),
        ({"base": ("hed",)}, UnknownName, "Did you mean 'head'"),
        ({"costs": {"hed": 2.0}}, UnknownName, "Did you mean 'head'"),
        ({"costs": {"wrist": 2.0}}, BadInput, "right_wrist is no place of this question"),
        ({"costs": {"head": 0.0}}, BadInput, "--cost head=0"),
        ({"fewest": 4}, BadInput, "4 to 3 stations of 11 places"),
        ({"most": 12}, BadInput, "Ask for 1 to 11"),
        ({"fewest": 0}, BadInput, "0 to 3 stations"),
        ({"base": ("head", "hand", "pelvis")}, BadInput, "3 stations cannot contain the 4 of --with"),
        ({"symmetric": True, "places": ("left_hand", "head", "pelvis")}, BadInput, "left_hand alone"),
        ({"symmetric": True, "places": ("hand", "ankle")}, BadInput, "No set of 3 stations"),
        ({"second_method": "expert_map"}, BadInput, "the first one too"),
        ({"clips": 200}, BadInput, "200 clips of 48 to choose on"),
        ({"constellation": "hal"}, UnknownName, "Did you mean 'hall'"),
    ],
)
def test_what_is_refused_says_why(changes: dict[str, Any], error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        question_study(replace(TRIPLES, **changes), None)


def test_a_line_that_is_too_slow_is_refused() -> None:
    asked = question_study(replace(TRIPLES, baud=300), None)
    with pytest.raises(BadInput, match=r"300 baud carries 3 stations at 0\.26 Hz"):
        plan_study(asked.study, lambda name: asked.scenario, None)


def test_a_library_without_the_behaviour_is_refused_with_those_that_it_has(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises((UnknownName, BadInput)):
        question_study(TRIPLES, tmp_path / "empty")


def test_few_example_frames_are_all_kept(mocap: Path) -> None:
    """Five real takes of boxing leave one to learn from; it has fewer frames than a method usually gets."""
    asked = question_study(PlacementQuestion(2, 2, ("boxing",), places=("head", "hand")), mocap)
    assert asked.scenario.motion.thin_to == 0
    uses = [{clip for unit in units.values() for clip in unit} for units in (asked.clips.pool, asked.clips.held_out)]
    assert not set.intersection(*uses, set(asked.clips.examples))
    assert question_study(TRIPLES, None).scenario.motion.thin_to == EXAMPLE_FRAMES
