"""Ratios, averages within a clip first, and what is refused, on planted errors."""

from dataclasses import replace

import pytest

from harness.bench.accuracy.clip_errors import ANGLE, CELL_METRICS, JITTER, SKATE, TRUE_JITTER, ClipErrors
from harness.bench.accuracy.targets import TARGETS, Target, evaluate_lag, evaluate_target, evaluate_targets
from harness.errors import BadInput
from tests.bench.accuracy.planted import clip_errors, errors

ALL = Target("boxing default", "boxing, default", 0.84, 0.75)


def test_every_row_is_the_ratio_of_its_means() -> None:
    results = evaluate_targets(errors(2.0), errors(1.5))
    assert [result.text for result in results] == [target.title for target in TARGETS]
    for result in results:
        factor = 2.0 if "silent" in result.text else 1.0
        assert result.more["stored_deg"] == pytest.approx(2.01 * factor)
        assert result.more["today_deg"] == pytest.approx(1.51 * factor)
        assert result.value == pytest.approx(1.51 / 2.01)


def test_seeds_are_averaged_within_a_clip_before_clips_are() -> None:
    skewed = {"boxing, default": {"a": clip_errors([1.0, 1.0, 1.0]), "b": clip_errors([5.0, 5.0, 5.0])}}
    assert evaluate_target(ALL, skewed, skewed).more["today_deg"] == pytest.approx(3.0)
    partly = ClipErrors("boxing", "known", dict.fromkeys(CELL_METRICS, (5.0, None, None)))
    unbalanced = {"boxing, default": {**skewed["boxing, default"], "b": partly}}
    assert evaluate_target(ALL, skewed, unbalanced).more["today_deg"] == pytest.approx(3.0)


def test_a_row_of_new_performers_has_their_clips_alone() -> None:
    today = errors(1.0, changed={("walking, clean", f"walking_new_{n}"): 3.0 for n in range(3)})
    by_title = {result.text: result for result in evaluate_targets(errors(1.0), today)}
    assert by_title["walking new, clean"].more["today_deg"] == pytest.approx(3.0)
    assert by_title["walking new, clean"].more["clip_names"] == [f"walking_new_{n}" for n in range(3)]
    assert by_title["walking known, clean"].value == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("today", "verdict", "goal"),
    [(0.749, "met", True), (0.75, "met", True), (0.751, "met", False), (0.84, "met", False), (0.841, "missed", False)],
)
def test_what_is_met(today: float, verdict: str, goal: bool) -> None:
    before, now = ({"boxing, default": {"a": clip_errors([value])}} for value in (1.0, today))
    found = evaluate_target(ALL, before, now)
    assert (found.verdict, found.target) == (verdict, "<= 0.84 (goal 0.75)")
    assert found.measured == f"{today:.3f}" + (" (goal met)" if goal else "")


@pytest.mark.parametrize("side", ["today", "in the stored errors"])
def test_a_missing_clip_is_refused(side: str) -> None:
    whole, part = errors(1.0), {"boxing, default": dict(errors(1.0)["boxing, default"])}
    del part["boxing, default"]["boxing_known_1"]
    before, now = (whole, part) if side == "today" else (part, whole)
    with pytest.raises(BadInput, match=f"boxing_known_1 {side} missing"):
        evaluate_target(ALL, before, now)


def test_a_condition_without_clips_is_refused_and_left_out_of_the_table() -> None:
    with pytest.raises(BadInput, match="every clip missing"):
        evaluate_target(ALL, {}, {})
    only = {"boxing, default": errors(1.0)["boxing, default"]}
    assert [result.text for result in evaluate_targets(errors(1.0), only)] == [
        target.title for target in TARGETS if target.condition == "boxing, default"
    ]


def test_another_number_of_seeds_is_refused() -> None:
    before, now = ({"boxing, default": {"a": clip_errors(values)}} for values in ([1.0, 1.0], [1.0]))
    with pytest.raises(BadInput, match="1 seeds today and 2 in the stored errors"):
        evaluate_target(ALL, before, now)


def test_an_error_that_was_not_measured_is_refused() -> None:
    planted = clip_errors([1.0])
    lost = replace(planted, by_metric={**planted.by_metric, ANGLE: (None,)})
    with pytest.raises(BadInput, match="not measured"):
        evaluate_target(ALL, {"boxing, default": {"a": planted}}, {"boxing, default": {"a": lost}})


@pytest.mark.parametrize(
    ("jitter", "skate", "met"),
    [
        (1.0, 130.0, ("met (goal met)", "met (goal met)")),
        (1.11, 131.0, ("met", "met")),
        (0.89, 180.0, ("met", "met")),
        (1.21, 181.0, ("missed", "missed")),
        (0.79, 0.0, ("missed", "met (goal met)")),
    ],
)
def test_the_row_with_a_lag(jitter: float, skate: float, met: tuple[str, str]) -> None:
    values = dict.fromkeys(CELL_METRICS, (1.0,)) | {TRUE_JITTER: (100.0,), JITTER: (100.0 * jitter,), SKATE: (skate,)}
    clips = {"a": ClipErrors("boxing", "known", values)}
    rows = evaluate_lag("m[lag=2]", clips, clips)
    assert [row.value for row in rows] == pytest.approx([jitter, skate])
    assert tuple(row.verdict + " (goal met)" * row.measured.endswith(" (goal met)") for row in rows) == met
