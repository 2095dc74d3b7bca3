"""The answer of a placement study in a sentence, and what its clips can show, before and after it ran."""

from dataclasses import replace

import pytest

from harness.report.kit.page_html import render_html
from harness.report.placement.answer import MOST_LETTERS, headline_sentence, placement_sentence, recommended_set
from harness.report.placement.page import placement_page, placement_text
from harness.report.placement.power_wording import format_duration, power_sentences
from harness.report.placement.question_answer import size_sentences
from harness.report.placement.wording import changes_sentence, ranks_by_condition
from harness.results.findings import BestSet, ChangedOrder, PlacementFindings, RankAgreement, StatisticalPower
from harness.results.findings.advice import PlacementAdvice, SecondChoice, SecondMethod, SetError, SizeStep

POWER = StatisticalPower(
    *(16, 165, "deg", 13, 590.0, 480.0, 0.4, 0.7, 1.02, 0.3, 190, 7000.0, 4),
)


CHOSEN = " Sets were chosen on 7 clips of 1 performer, this performer only."


@pytest.fixture(scope="module")
def findings(placement: PlacementFindings) -> PlacementFindings:
    return replace(placement, power=POWER)


def test_the_answer_is_of_the_size_that_was_asked_for(findings: PlacementFindings) -> None:
    best = findings.best[1]
    tested = replace(best, held_out=2.0, held_out_low=1.8, held_out_high=2.2, held_out_clips=16)
    tied = replace(tested, ties=(("head", "pelvis"), ("sternum", "pelvis")), of=55)
    asked = replace(findings, sizes=(2,), best=(findings.best[0], tied, findings.best[2]))
    assert placement_sentence(asked) == (
        "Best two stations for walking: left hand + pelvis, 2.0 deg (1.8 to 2.2) on 16 held-out units. It is tied with "
        f"2 of the 54 other pairs that were tried: head + pelvis; sternum + pelvis.{CHOSEN}"
    )
    assert placement_text(asked).startswith("Best two stations for walking: left hand + pelvis")
    assert placement_page(asked).headline == placement_sentence(asked).partition(" It is tied")[0]
    assert " ".join(placement_text(asked).split()).startswith(placement_sentence(asked))


def test_every_size_that_was_asked_for_has_its_sentence(findings: PlacementFindings) -> None:
    asked = replace(findings, sizes=(1, 3, 4), behaviours=("walking", "table_tennis"))
    said = placement_sentence(asked)
    assert said.startswith("Best station for walking and table tennis: ")
    assert "Best three stations for walking and table tennis: both hands + pelvis, " in said
    assert said.endswith(f"No set of 4 stations was measured.{CHOSEN}")


def test_without_ties_and_without_held_out_clips_the_answer_says_so(findings: PlacementFindings) -> None:
    alone = BestSet(findings.best[0].stations, of=3)
    said = placement_sentence(replace(findings, sizes=(1,), best=(alone,)))
    assert "on the clips on which it was chosen. No other place is tied with it." in said
    assert "No other place was tried" in placement_sentence(replace(findings, sizes=(1,), best=(replace(alone, of=1),)))


def test_clips_that_cannot_tell_sets_apart_are_no_tie(findings: PlacementFindings) -> None:
    best = findings.best[0]
    others = tuple((place.name,) for place in findings.candidates if (place.name,) != best.stations)
    asked = replace(findings, sizes=(1,), best=(replace(best, ties=others, of=3),))
    assert placement_sentence(asked).endswith(f" cannot tell it from the other 2 places (13 might).{CHOSEN}")
    enough = replace(asked, power=replace(POWER, least_clips=1))
    assert "It is tied with 2 of the 2 other places that were tried: " in placement_sentence(enough)
    two = replace(enough, best=(replace(best, ties=others[:1], of=2),))
    assert "It is tied with the only other place that was tried: " in placement_sentence(two)


def test_what_the_clips_can_show_comes_with_the_time_that_more_would_take() -> None:
    first, second = power_sentences(POWER)
    assert first == (
        "16 units can show a difference of 1.02 deg between two of 165 sets (power 80 %, p corrected for 164 "
        "comparisons). The study takes 10 min."
    )
    assert second == (
        "A difference of 0.3 deg, a tenth of the error, would need about 190 units, about 1.9 h. Spread and time are "
        "those of the first 4 sets."
    )
    assert power_sentences(replace(POWER, needed_clips=16)) == [first]


def test_too_few_clips_are_said_before_anything_else() -> None:
    few = replace(POWER, clips=3, sets=3, least_clips=7, duration_s=20.0, least_duration_s=44.0, needed_clips=None)
    assert power_sentences(few) == [
        "3 units cannot show any difference between 3 sets, 7 might (44 s). The study takes 20 s."
    ]
    unknown = replace(few, duration_s=None, least_duration_s=None)
    assert power_sentences(unknown) == ["3 units cannot show any difference between 3 sets, 7 might."]
    assert power_sentences(replace(few, sets=1)) == [
        "One set is measured on 3 units: nothing is compared. The study takes 20 s."
    ]
    assert "unknown" in power_sentences(replace(few, clips=7, shown=None))[0]


def test_the_text_and_the_page_keep_what_was_announced(findings: PlacementFindings) -> None:
    assert power_sentences(POWER)[0] in " ".join(placement_text(findings).split())
    assert power_sentences(POWER)[1] in render_html(placement_page(findings), with_charts=False)
    assert "<dt>Clips</dt>" not in render_html(placement_page(replace(findings, power=None)), with_charts=False)


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(None, "not measured"), (40.4, "40 s"), (89.9, "90 s"), (420.0, "7 min"), (12600.0, "3.5 h"), (1e6, "12 days")],
)
def test_durations_are_rough(seconds: float | None, said: str) -> None:
    assert format_duration(seconds) == said


def test_sets_have_a_rank_under_each_condition(findings: PlacementFindings) -> None:
    means = ((2.0, 1.0, 3.0), (2.0, 2.0, None), (1.0, 2.0, 3.0))
    like = (*findings.conditions, findings.conditions[-1])
    conditions = tuple(replace(c, means=m) for c, m in zip(like, means, strict=True))
    few = replace(findings, compared=(("head",), ("pelvis",), ("sternum",)), conditions=conditions)
    assert ranks_by_condition(few, 9) == [
        (("pelvis",), [1, 1, 2]),
        (("head",), [2, 1, 1]),
        (("sternum",), [3, None, 3]),
    ]
    assert len(ranks_by_condition(few, 2)) == 2
    assert ranks_by_condition(replace(few, better="higher"), 9)[0] == (("sternum",), [1, None, 1])
    assert ranks_by_condition(replace(few, conditions=()), 9) == []
    rows = [line.split() for line in placement_text(few).splitlines() if line.startswith("sternum  ")]
    assert ["sternum", "3", "not", "measured", "3"] in rows
    assert 'aria-label="ranks"' in render_html(placement_page(few), with_charts=False)


def test_changes_of_order_are_counted_and_the_first_is_named(findings: PlacementFindings) -> None:
    change = ChangedOrder(("head",), ("left_ankle", "right_ankle"), (0.5, -0.25), significant=True)
    pair = RankAgreement("a", "b", 0.5, 5, changed=(change,), changes=3, significant_changes=1)
    said = "3 of 10 pairs change their order, 1 significantly: first head against both ankles, +0.5 to −0.25 deg"
    assert changes_sentence(findings, pair) == said
    own = replace(pair, a=findings.conditions[0].name)
    assert said in " ".join(placement_text(replace(findings, agreements=(own,))).split())
    assert "are on the page alone: 1." in placement_text(replace(findings, agreements=(own, pair)))
    assert said in render_html(placement_page(replace(findings, agreements=(pair,))), with_charts=False)
    untested = replace(pair, changes=1, changed=(replace(change, significant=None),))
    assert changes_sentence(findings, untested).startswith(
        "1 of 10 pairs changes its order (too few units or too many sets to test): first"
    )
    assert changes_sentence(findings, replace(pair, changes=0, changed=())) == "no pair of 10 changes its order"


@pytest.mark.parametrize(
    ("clips", "said"),
    [
        ([f"performer {k}" for k in range(1, 7)], " Sets were chosen on 6 performers."),
        ([f"walking_p{1 + k % 3}_{k:02d}" for k in range(1, 7)], " Sets were chosen on 6 clips of 3 performers."),
    ],
)
@pytest.mark.parametrize("sizes", [(), (2,)])
def test_the_answer_states_how_many_performers_the_clips_are_of(
    clips: list[str], said: str, sizes: tuple[int, ...], findings: PlacementFindings
) -> None:
    tried = tuple(replace(one, errors=dict(zip(clips, one.errors.values(), strict=False))) for one in findings.tried)
    assert placement_sentence(replace(findings, tried=tried, sizes=sizes)).endswith(said)


ONE, TWO, THREE = ("pelvis",), ("left_hand", "pelvis"), ("right_hand", "left_hand", "pelvis")


@pytest.fixture
def asked(placement: PlacementFindings) -> PlacementFindings:
    """A question of one to three stations, of which two are advised."""
    best = tuple(
        BestSet(names, of=3, held_out=error, held_out_low=error - 0.2, held_out_high=error + 0.2, held_out_clips=32)
        for names, error in ((ONE, 6.1), (TWO, 4.14), (THREE, 4.68))
    )
    steps = (
        SizeStep(ONE, TWO, 2.0, 1.5, 2.5, 0.001, 32, "better"),
        SizeStep(ONE, THREE, 1.5, 1.0, 2.0, 0.001, 32, "better"),
        SizeStep(TWO, THREE, -0.5, -0.9, 0.1, 0.2, 32, "cannot tell"),
    )
    tried = tuple(replace(one, errors={f"performer {n}": 1.0 for n in range(8)}) for one in placement.tried)
    advice = PlacementAdvice(SetError(TWO, 4.14, 3.94, 4.34, 32), "between", of=3)
    return replace(
        placement,
        sizes=(1, 2, 3),
        best=best,
        size_steps=steps,
        tried=tried,
        advice=advice,
        effort="quick",
        split="known",
        behaviours=("walking", "boxing"),
    )


def test_the_advice_comes_first_and_no_larger_set_goes_without_a_word(asked: PlacementFindings) -> None:
    said = placement_sentence(asked)
    assert said == (
        "Wear two stations for walking and boxing: left hand + pelvis (a quick search). It errs 4.14 deg (3.94 to "
        "4.34) on 32 held-out known performers."
    )
    assert size_sentences(asked) == [
        "One station is worse: pelvis, 6.1 deg (5.9 to 6.3).",
        "Three stations are not better: both hands + pelvis, 4.68 deg (4.48 to 4.88).",
    ]
    worse = replace(asked, size_steps=(*asked.size_steps[:2], replace(asked.size_steps[2], verdict="worse")))
    assert size_sentences(worse)[1].startswith("Three stations are worse: ")
    assert size_sentences(replace(asked, sizes=(1, 2, 3, 4)))[2] == "No set of 4 stations was measured."
    assert placement_page(asked).headline == said.partition(" It errs")[0]


def test_sets_that_cannot_be_told_from_the_advised_one_stand_beside_it(asked: PlacementFindings) -> None:
    assert asked.advice is not None
    tied = replace(asked.advice, ties=(("right_hand", "pelvis"),))
    assert (
        "left hand + pelvis, or right hand + pelvis, which cannot be told from it (a quick search). "
        in placement_sentence(replace(asked, advice=tied))
    )
    many = replace(tied, ties=(("right_hand", "pelvis"), ("right_hand", "left_hand")), of=15)
    assert (
        "left hand + pelvis, or one of 2 pairs of 15 that cannot be told from it (a quick search). "
        in placement_sentence(replace(asked, advice=many))
    )


def test_stations_that_are_worn_anyway_are_added_to(asked: PlacementFindings) -> None:
    said = placement_sentence(replace(asked, base=("pelvis",), split="new", effort="thorough"))
    assert said.startswith("For walking and boxing, add left hand to pelvis (a thorough search). It errs 4.14 deg")
    assert said.endswith(" on 32 held-out new performers.")
    assert "left hand + pelvis suffices (a quick search)." in placement_sentence(replace(asked, base=TWO))


BOTH = ("right_hand", "left_hand")


def disputed(asked: PlacementFindings, shared: tuple[str, ...] = (), best: tuple[str, ...] = BOTH) -> PlacementFindings:
    """The methods disagree on the advised pair and, which is not told, on the best place."""
    own = SetError(shared, 4.2, 4.0, 4.4, 32) if shared else None
    choice = SecondChoice(TWO, best, 0.8, 0.5, 1.1, worse=True, of=4, units=8, shared=own)
    other = replace(choice, chosen=ONE)
    return replace(asked, methods=("expert_map",), second=SecondMethod("ik", (other, choice)))


def test_a_set_that_is_good_under_both_methods_comes_before_their_disagreement(asked: PlacementFindings) -> None:
    findings = disputed(asked, BOTH)
    assert placement_sentence(findings) == (
        "Wear two stations for walking and boxing: both hands, good under both methods (a quick search). They disagree "
        "on the best: with left hand + pelvis, which expert_map prefers, ik errs 0.8 deg (0.5 to 1.1) more than with "
        "it. Under expert_map, the error of both hands is 4.2 deg (4.0 to 4.4) on 32 held-out known performers, that "
        "of left hand + pelvis 4.14 deg (3.94 to 4.34)."
    )
    assert headline_sentence(findings) == (
        "Wear both hands, good under both methods (a quick search). They disagree: ik errs 0.8 deg (0.5 to 1.1) more "
        "with expert_map's best."
    )
    assert recommended_set(findings) == BOTH
    other = placement_sentence(disputed(asked, BOTH, ("right_hand", "pelvis")))
    assert "ik errs 0.8 deg (0.5 to 1.1) more than with right hand + pelvis." in other


def test_without_a_set_that_is_good_under_both_the_headline_has_both_choices(asked: PlacementFindings) -> None:
    findings = disputed(asked)
    assert placement_sentence(findings) == (
        "None of 4 pairs is good under both methods for walking and boxing: expert_map prefers left hand + pelvis, ik "
        "both hands (a quick search). With left hand + pelvis, ik errs 0.8 deg (0.5 to 1.1) more than with both hands. "
        "Under expert_map, the error of left hand + pelvis is 4.14 deg (3.94 to 4.34) on 32 held-out known performers."
    )
    assert headline_sentence(findings) == (
        "None of 4 pairs is good under both methods: expert_map prefers left hand + pelvis, ik both hands, by 0.8 deg "
        "(0.5 to 1.1)."
    )
    assert recommended_set(findings) == TWO
    four, other = ("right_hand", "left_hand", "right_ankle", "left_ankle"), ("right_hand", "left_hand", "left_ankle")
    assert findings.advice is not None
    assert findings.second is not None
    choice = replace(
        findings.second.choices[1], chosen=four, best=(*other, "pelvis"), difference=0.266, low=0.06, high=0.73
    )
    longer = replace(findings.advice, best=replace(findings.advice.best, stations=four))
    assert headline_sentence(replace(findings, advice=longer, second=SecondMethod("ik", (choice,)))) == (
        "None of 4 sets is good under both: expert_map prefers both hands + both ankles, ik both hands + left ankle + "
        "pelvis, by 0.27 deg."
    )


def test_a_disagreement_that_is_not_significant_changes_nothing(asked: PlacementFindings) -> None:
    apart = disputed(asked)
    assert apart.second is not None
    agreeing = replace(apart.second, choices=(apart.second.choices[0], replace(apart.second.choices[1], worse=False)))
    assert placement_sentence(replace(apart, second=agreeing)) == placement_sentence(asked)


@pytest.mark.parametrize("stations", [2, 4, 12])
@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("worse", [True, False])
@pytest.mark.parametrize("method", ["expert_map", "some_module_of_mine.methods:MyOwnMethod[neighbours=12]"])
def test_every_headline_has_two_lines_at_most(
    asked: PlacementFindings, method: str, stations: int, *, shared: bool, worse: bool
) -> None:
    """The longest names, and as many ties as there can be; then a study in a file that asks about twelve sizes."""
    names = (
        *("right_upper_arm", "left_forearm", "right_thigh", "left_ankle", "right_hand", "left_foot", "head", "pelvis"),
        *("torso", "right_shin", "left_thigh", "left_shoulder"),
    )
    chosen, other = names[:stations], names[-stations:]
    both = SetError(other, 14.25, 13.75, 14.75, 32) if shared else None
    choice = SecondChoice(chosen, other, 10.75, 10.25, 11.25, worse, 4, 48, both)
    long = replace(
        asked,
        behaviours=("table_tennis", "jumping"),
        methods=(method,),
        effort="thorough",
        advice=PlacementAdvice(SetError(chosen, 14.25, 13.75, 14.75, 32, 12.5), "between", (other,) * 480, 495),
        second=SecondMethod("ik", (choice,)),
    )
    headline = headline_sentence(long)
    assert len(headline) <= MOST_LETTERS
    assert ("good under both" in headline) is worse
    in_file = replace(long, advice=None, sizes=tuple(range(1, 13)), best=(BestSet(chosen, (other,) * 480, of=495),))
    assert len(headline_sentence(in_file)) <= MOST_LETTERS


def test_a_larger_set_that_is_not_shown_to_be_better_is_not_called_worse_and_a_smaller_one_not_better(
    asked: PlacementFindings,
) -> None:
    """A place that three stations beat, and the advised two do not."""
    step = next(step for step in asked.size_steps if (step.smaller, step.larger) == (ONE, TWO))
    steps = tuple(replace(one, verdict="cannot tell") if one == step else one for one in asked.size_steps)
    assert size_sentences(replace(asked, size_steps=steps))[0].startswith("One station is not shown to be worse: ")


def test_with_costs_the_lines_are_of_costs(asked: PlacementFindings) -> None:
    front = tuple(
        SetError(names, error, error - 0.2, error + 0.2, 32, cost)
        for names, error, cost in ((ONE, 6.1, 1.0), (TWO, 4.14, 2.5), (THREE, 4.0, 4.0))
    )
    advice = PlacementAdvice(front[1], "between", of=3)
    priced = replace(asked, front=front, advice=advice, station_costs={"pelvis": 1.0, "left_hand": 1.5})
    assert "left hand + pelvis, at a cost of 2.5 (a quick search). It errs 4.14 deg" in placement_sentence(priced)
    assert size_sentences(priced) == [
        "A cost of 1 is worse: pelvis, 6.1 deg (5.9 to 6.3).",
        "A cost of 4 is not better: both hands + pelvis, 4.0 deg (3.8 to 4.2).",
    ]
