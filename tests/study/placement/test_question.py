"""A question without a file: its clips, its places, what fits into its budget of time, and what is refused."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.errors import BadInput, UnknownName
from harness.study.placement.plan import plan_study
from harness.study.placement.question import EXAMPLE_FRAMES, PlacementQuestion, plan_within_budget, question_study

TRIPLES = PlacementQuestion(3, 3, ("table_tennis",))


def test_clips_to_choose_on_to_test_and_to_learn_from_are_disjoint_and_of_all_performers() -> None:
    study, scenario = question_study(TRIPLES, None)
    roles = scenario.motion.test, study.held_out, scenario.motion.examples
    assert [len(role) for role in roles] == [16, 16, 32]
    assert len(set().union(*roles)) == 64
    performers = [{name.split("_")[2] for name in role} for role in roles]
    assert performers[0] == {f"p{n}" for n in range(1, 17)}
    assert performers[1] == {f"p{n}" for n in range(17, 33)}  # the choice is tested on others
    assert performers[2] == performers[0] | performers[1]  # of each, methods have learnt another take
    assert scenario.motion.behaviours == ("table_tennis",)


def test_several_behaviours_have_equal_shares() -> None:
    question = replace(TRIPLES, behaviours=("walking", "boxing"), places=("head", "hand", "pelvis"))
    study, scenario = question_study(question, None)
    assert scenario.motion.behaviours == ("walking", "boxing") * 8
    assert [clip.startswith("walking") for clip in scenario.motion.test] == [True, False] * 8
    assert len({clip.split("_")[1] for clip in (*scenario.motion.test, *study.held_out)}) == 32
    plan = plan_study(study, lambda name: scenario, None)
    assert plan.held_out is not None
    assert plan.held_out.motion.behaviours == ("walking", "boxing") * 8
    assert question.name == "walking_boxing_3"
    assert question.title == "Where are 3 stations worn for walking and boxing?"


def test_a_constellation_asks_for_the_physics_of_the_tracker() -> None:
    _, scenario = question_study(replace(TRIPLES, constellation="hall"), None)
    assert scenario.physics is not None
    assert scenario.physics.constellation.name == "hall"
    assert question_study(TRIPLES, None)[1].physics is None


def test_every_set_of_each_size_is_planned() -> None:
    question = replace(TRIPLES, fewest=2, places=("head", "hand", "pelvis"))
    study, scenario = question_study(question, None)
    plan = plan_study(study, lambda name: scenario, None)
    assert sorted(map(len, plan.known_sets())) == [2] * 6 + [3] * 4
    assert study.sizes == (2, 3)
    assert plan.first_sets() == [stations for stations in plan.known_sets() if len(stations) == 2]
    assert plan.cell_count(16) == 10 * 16 + 2 * 16
    assert question.name == "table_tennis_2-3"


def test_the_budget_decides_how_sets_are_searched_and_on_how_many_clips() -> None:
    study, scenario = question_study(TRIPLES, None)

    def within(cell_s: float, **changes: float) -> tuple[bool, int, str]:
        question = replace(TRIPLES, **changes)  # type: ignore[arg-type]
        study_within, shortened, note = plan_within_budget(study, scenario, question, cell_s, jobs=2)
        assert (study_within.greedy is None) is (study_within.exhaustive is not None)
        return study_within.exhaustive is not None, len(shortened.motion.test), note

    assert within(0.4)[:2] == (True, 16)  # 165 sets on 16 clips and 16 held-out cells: 531 s
    assert within(0.5)[:2] == (True, 13)  # 13 clips are the fewest that can show anything among 165 sets: 540 s
    assert within(0.6)[:2] == (False, 16)  # 11 + 10 + 9 sets on 16 clips
    assert within(0.4, minutes=2.0)[:2] == (False, 16)
    assert within(0.4, minutes=1.0)[:2] == (False, 9)
    assert within(0.4, minutes=0.1)[:2] == (False, 6)
    assert within(0.5)[2] == "Within 10 minutes: every one of 165 sets, on 13 clips."
    assert within(0.6)[2].endswith("Every one of 165 sets would take about 13 minutes on 16 clips.")


def test_clips_that_are_asked_for_are_not_reduced() -> None:
    question = replace(TRIPLES, clips=7)
    study, scenario = question_study(question, None)
    _, shortened, _ = plan_within_budget(study, scenario, question, 60.0, jobs=1)
    assert len(shortened.motion.test) == 7


@pytest.mark.parametrize(
    ("changes", "error", "said"),
    [
        ({"behaviours": ("table_tenis",)}, UnknownName, "Did you mean 'table_tennis'"),
        ({"places": ("hed",)}, UnknownName, "Did you mean 'head'"),
        ({"fewest": 4}, BadInput, "4 to 3 stations of 11 places"),
        ({"most": 12}, BadInput, "Ask for 1 to 11"),
        ({"fewest": 0}, BadInput, "0 to 3 stations"),
        ({"clips": 200}, BadInput, "200 clips of 128 to choose on"),
    ],
)
def test_what_is_refused_says_why(changes: dict[str, object], error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        question_study(replace(TRIPLES, **changes), None)  # type: ignore[arg-type]


def test_a_library_without_the_behaviour_is_refused_with_those_that_it_has(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises((UnknownName, BadInput)):
        question_study(TRIPLES, tmp_path / "empty")


def test_few_example_frames_are_all_kept(mocap: Path) -> None:
    """Five real takes of boxing leave one to learn from; it has fewer frames than a method usually gets."""
    _, scenario = question_study(PlacementQuestion(2, 2, ("boxing",), places=("head", "hand")), mocap)
    assert scenario.motion.thin_to == 0
    assert question_study(TRIPLES, None)[1].motion.thin_to == EXAMPLE_FRAMES
