"""Two sides compared: outcomes and why, what is allowed, coverage, groups, clip means, directions."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.compare.comparison import EVERYTHING, Comparison, compare_results
from harness.compare.margins import MARGINS
from harness.errors import Outcome, UnknownName
from harness.report.comparison.page import comparison_page, comparison_text
from harness.report.comparison.wording import comparison_sentence, describe_parts
from harness.report.kit import render_html
from harness.results import ResultSet
from harness.score import DEFINITIONS
from tests.compare.sides import SIZES, cell, manifest, side

ANGLE, *_ = SIZES
STEADY = [1.1 + 0.01 * n for n in range(8)]
"""Worse by 10 to 17 %, clip by clip."""
TORN = [0.7, 1.4, 0.8, 1.3, 0.7, 1.4, 0.9, 1.2]


def found(b: ResultSet, a: ResultSet | None = None, **options: Any) -> Comparison:
    return compare_results(a or side(), b, **{"metrics": [ANGLE], **options})


@pytest.mark.parametrize(
    ("b", "outcome", "why"),
    [
        (side(), Outcome.PASS, "of 1 gated lines 1 are the same, 0 better"),
        (side(methods={"ik": [1.0 - (t - 1.0) for t in STEADY]}), Outcome.PASS, "0 are the same, 1 better"),
        (side(methods={"ik": STEADY}), Outcome.REGRESSED, f"1 of 1 gated lines are worse: ik {ANGLE}"),
        (side(methods={"ik": TORN}), Outcome.NOT_COMPARABLE, "exceeds the margin"),
        (side(clips=5), Outcome.NOT_COMPARABLE, "cells are only in A"),
        (side(scenario="other"), Outcome.NOT_COMPARABLE, "no cell of A has a partner in B (scenario: demo against"),
        (ResultSet("B", manifest(), (), 0), Outcome.NOT_COMPARABLE, "no cell of A has a partner in B (a side has no"),
        (side(metrics={ANGLE: None}), Outcome.NOT_COMPARABLE, f"{ANGLE} was measured on one side only in 8 of 8 cells"),
        (side(defined_by={"calibration": "poses"}), Outcome.NOT_COMPARABLE, "inputs differ: calibration: none against"),
        (side(failed=["ik on walk_99"]), Outcome.INCOMPLETE, "planned cells are missing: B: ik on walk_99"),
        (replace(side(), planned=11), Outcome.INCOMPLETE, "B: 3 cells are not finished"),
        (ResultSet("B", manifest(), (), 1, ("ik on walk_00",)), Outcome.INCOMPLETE, "ik on walk_00"),
    ],
)
def test_outcomes(b: ResultSet, outcome: Outcome, why: str) -> None:
    comparison = found(b)
    assert comparison.outcome == outcome
    assert why in comparison.why


def test_worse_is_worse_whatever_else_is_missing_but_not_where_inputs_differ() -> None:
    b = side(methods={"ik": STEADY}, failed=["ik on walk_99"])
    assert found(b).outcome == Outcome.REGRESSED
    assert found(b).failed == ("B: ik on walk_99",)
    other = side(methods={"ik": STEADY}, defined_by={"calibration": "poses"})
    assert found(other).outcome == Outcome.NOT_COMPARABLE
    assert found(other).differences == ()


def test_times_are_gated_between_equal_processors_alone() -> None:
    metrics = {"step_relative": 2.0}
    slower = side(metrics={"step_relative": 3.5})
    for processor, outcome in (("Xeon", Outcome.REGRESSED), ("Opteron", Outcome.PASS)):
        a = replace(side(metrics=metrics), manifest=manifest(processor="Xeon"))
        b = replace(slower, manifest=manifest(processor=processor))
        comparison = found(b, a, metrics=[ANGLE, "step_relative"])
        assert comparison.outcome == outcome
        (line,) = (line for line in comparison.differences if line.metric == "step_relative")
        assert (line.gated, line.verdict) == (processor == "Xeon", "worse")
        alone = found(b, a, metrics=["step_relative"])
        assert alone.outcome == (Outcome.REGRESSED if processor == "Xeon" else Outcome.NOT_COMPARABLE)


def test_a_result_beside_itself_differs_by_exactly_nothing() -> None:
    a = side(methods={"ik": 1.0, "mean_pose": 3.0})
    comparison = compare_results(a, a)
    assert comparison.outcome == Outcome.PASS
    assert {line.verdict for line in comparison.differences} == {"same"}
    assert {(line.difference, line.low, line.high, line.p) for line in comparison.differences} == {(0.0, 0.0, 0.0, 1.0)}
    assert comparison.circumstances == ()


def test_six_clips_show_a_difference_and_five_do_not() -> None:
    for clips, outcome in ((6, Outcome.REGRESSED), (5, Outcome.NOT_COMPARABLE)):
        assert found(side(methods={"ik": 2.0}, clips=clips), side(clips=clips)).outcome == outcome
    assert "too few units: 5, of at least 6" in found(side(methods={"ik": 2.0}, clips=5), side(clips=5)).why


@pytest.mark.parametrize("clips", [1, 2, 5])
def test_identical_results_are_the_same_on_few_clips(clips: int) -> None:
    comparison = found(side(clips=clips), side(clips=clips))
    assert comparison.outcome == Outcome.PASS
    (line,) = [line for line in comparison.differences if line.gated]
    assert (line.verdict, line.low, line.high, line.p) == ("same", 0.0, 0.0, None)


def test_nearly_equal_results_are_the_same_on_five_clips_and_not_on_one() -> None:
    """The margin is 2 %; errors differ by up to 0.3 %, with either sign."""
    times = [1.003, 0.998, 1.001, 0.999, 1.002]
    assert found(side(methods={"ik": times}, clips=5), side(clips=5)).outcome == Outcome.PASS
    assert found(side(methods={"ik": times[:1]}, clips=1), side(clips=1)).outcome == Outcome.NOT_COMPARABLE
    times[0] = 1.1
    assert found(side(methods={"ik": times}, clips=5), side(clips=5)).outcome == Outcome.NOT_COMPARABLE


def test_clips_are_what_counts_and_their_cells_are_averaged() -> None:
    """Seeds and varied values of one clip are no further witnesses."""
    times = [1.0, 1.1, 1.3]
    many = [cell("walk_01", times=t, seed=n) for n, t in enumerate(times)]
    run = ResultSet("A", manifest(), (*side(clips=1).cells, *many), 4)
    comparison = found(run, run)
    (line,) = [line for line in comparison.differences if line.gated]
    assert (comparison.matched, line.clips) == (4, ("walk_00", "walk_01"))
    assert line.a[1] == pytest.approx(np.mean([c.metrics[ANGLE] or 0.0 for c in many]))
    assert line.mean_a == pytest.approx(np.mean(line.a))


def test_inputs_and_splits_are_never_pooled_and_known_and_new_performers_are_parts() -> None:
    parts = [side(), side(performer="new", seed=2), side(inputs="pos"), side(split="block")]
    run = ResultSet("A", manifest(), tuple(c for part in parts for c in part.cells), 32)
    lines = found(run, run).differences
    assert [line.group for line in lines if line.gated] == ["pos+ori, sequence", "pos, sequence", "pos+ori, block"]
    assert [(line.group, line.part) for line in lines if line.part and line.metric == ANGLE] == [
        ("pos+ori, sequence", "known performers"),
        ("pos+ori, sequence", "new performers"),
    ]


def test_a_line_names_the_behaviour_that_decides_it() -> None:
    """Eight performers box better by a fifth; eight others walk as before."""
    clips = [f"{what}_p{n}_01" for what, first in (("walking", 1), ("boxing", 9)) for n in range(first, first + 8)]
    sides = []
    for times in (1.0, 0.8):
        cells = [cell(clip, times=times + 0.01 * n if "boxing" in clip else 1.0) for n, clip in enumerate(clips)]
        sides.append(
            ResultSet("A", manifest(), tuple(replace(c, behaviour=c.clip.partition("_")[0]) for c in cells), 16)
        )
    comparison = found(sides[1], sides[0])
    (line,) = [line for line in comparison.differences if line.gated]
    assert (len(line.units), line.verdict) == (16, "better")
    assert describe_parts(comparison, line) == "better for boxing (8 performers), the same elsewhere"
    assert f"✓ ik {ANGLE}: better for boxing (8 performers), the same elsewhere" in comparison_text(comparison)
    page = render_html(comparison_page(comparison), with_charts=False)
    assert f"{ANGLE}: better for boxing (8 performers), the same elsewhere." in page
    again = found(sides[0], sides[0])
    assert describe_parts(again, again.differences[0]) == "the same for walking (8 performers), boxing (8 performers)"


def test_parts_by_behaviour_and_by_performer_are_described_one_after_the_other() -> None:
    """Six known and six new performers are worse alike; each walks and boxes, with too large a scatter in boxing."""
    sides = []
    for change in (0.0, 0.3):
        cells = []
        for n in range(1, 13):
            for behaviour in ("walking", "boxing"):
                times = 1.0 + change + (0.5 * (-1) ** n * change / 0.3 if behaviour == "boxing" else 0.01 * n)
                known = "known" if n % 2 else "new"
                of_it = cell(f"{behaviour}_p{n}_01", times=times, performer=known)
                cells.append(replace(of_it, behaviour=behaviour))
        sides.append(ResultSet("A", manifest(), tuple(cells), 24))
    comparison = found(sides[1], sides[0])
    said = describe_parts(comparison, comparison.differences[0])
    assert said.startswith("worse for walking (12 performers), no difference shown elsewhere; ")
    assert said.count("elsewhere") == 1 + said.endswith("elsewhere")


def test_clips_of_one_performer_count_once() -> None:
    """Eight clips of two performers are worse by 10 to 17 %, which two units cannot show."""
    of_two = {f"walk_{n:02}": "Anna" if n < 4 else "Bert" for n in range(8)}
    a, b = (
        replace(each, manifest=replace(each.manifest, performers=of_two))
        for each in (side(), side(methods={"ik": STEADY}))
    )
    comparison = found(b, a)
    assert comparison.outcome == Outcome.NOT_COMPARABLE
    (line,) = [line for line in comparison.differences if line.gated]
    assert (line.units, len(line.clips)) == (("performer Anna", "performer Bert"), 8)
    assert line.mean_b == pytest.approx(np.mean(line.b))


def test_times_are_gated_between_versions_of_a_method_and_not_between_methods() -> None:
    run = side(methods={"ik": 1.0, "ik[damping=2]": 1.0, "mean_pose": 1.0}, metrics={"step_relative": 2.0})
    for other, gated in (("ik[damping=2]", True), ("ik", True), ("mean_pose", False)):
        lines = compare_results(run, run, methods=("ik", other)).differences
        assert {line.gated for line in lines if line.metric == "step_relative"} == {gated}
    asked = compare_results(run, run, methods=("ik", "mean_pose"), metrics=["step_relative"]).differences
    assert next(line for line in asked if line.metric == "step_relative").gated


def test_a_metric_that_should_rise_is_worse_when_it_falls() -> None:
    cells = [replace(c, metrics={**c.metrics, "fps": 100.0 + n}) for n, c in enumerate(side().cells)]
    slow = [replace(c, metrics={**c.metrics, "fps": 60.0 + n}) for n, c in enumerate(cells)]
    a, b = (replace(side(), cells=tuple(each)) for each in (cells, slow))
    (line,) = [line for line in found(b, a, metrics=["fps"]).differences if line.gated]
    assert (line.verdict, line.difference, line.low, line.high) == ("worse", -40.0, -40.0, -40.0)
    assert found(a, b, metrics=["fps"]).outcome == Outcome.PASS


def test_two_methods_of_one_run() -> None:
    run = side(methods={"ik": 1.0, "mean_pose": STEADY}, failed=["best_match on walk_00"])
    comparison = compare_results(run, run, methods=("ik", "mean_pose"), metrics=[ANGLE])
    assert (comparison.outcome, comparison.differences[0].method) == (Outcome.REGRESSED, "ik vs mean_pose")
    assert compare_results(run, run, methods=("mean_pose", "ik"), metrics=[ANGLE]).outcome == Outcome.PASS
    assert compare_results(run, run, methods=("ik", "ik"), metrics=[ANGLE]).differences[0].method == "ik"


OTHER_RATE = {"tracker": {"rate_hz": 60.0, "items": [40, 2]}}


@pytest.mark.parametrize("allow", [["tracker"], ["tracker.rate_hz"], ["seed", "tracker"], [EVERYTHING]])
def test_inputs_that_are_allowed_may_differ(allow: list[str]) -> None:
    b = side(defined_by=OTHER_RATE)
    assert found(b).inputs_that_differ == ("tracker.rate_hz: 40 against 60",)
    comparison = found(b, allow=allow)
    assert (comparison.outcome, comparison.inputs_that_differ) == (Outcome.PASS, ())
    assert comparison.allowed == ("tracker.rate_hz: 40 against 60",)


def test_allowing_one_input_leaves_the_others_and_a_strange_name_is_refused() -> None:
    b = side(defined_by={**OTHER_RATE, "calibration": "poses"})
    assert found(b, allow=["tracker"]).inputs_that_differ == ("calibration: none against poses",)
    with pytest.raises(UnknownName, match=r"'traker'.*Did you mean 'tracker'"):
        found(b, allow=["traker"])


def test_what_cells_pair_on_may_be_allowed_too() -> None:
    b = side(scenario="other", seed=2)
    assert found(b, allow=["scenario", "seed"]).outcome == Outcome.PASS
    assert found(b, allow=["scenario"]).outcome == Outcome.NOT_COMPARABLE


def test_many_inputs_inside_one_are_told_in_one_line() -> None:
    b = side(defined_by={"examples": {f"run_{n}": "digest" for n in range(6)}})
    assert found(b).inputs_that_differ == ("examples.walk_0: digest 0 against none (and 11 more of examples)",)


@pytest.mark.parametrize(("matched", "told"), [(200, False), (199, True), (150, True)])
def test_both_sides_must_cover_the_same(matched: int, told: bool) -> None:
    b = side(metrics={"frames_matched": matched})
    comparison = found(b)
    assert (comparison.outcome == Outcome.NOT_COMPARABLE) == bool(comparison.coverage) == told
    if told:
        assert f"covers 1600 of 1600 frames in A, {8 * matched} of 1600 frames in B" in comparison.why
    assert found(b, allow=["coverage"]).outcome == Outcome.PASS


def test_both_sides_must_cover_enough() -> None:
    for matched, outcome in ((190, Outcome.PASS), (189, Outcome.NOT_COMPARABLE)):
        part = side(metrics={"frames_matched": matched})
        assert found(part, part).outcome == outcome


def test_what_one_side_alone_measured_is_told() -> None:
    cells = side().cells
    b = replace(side(), cells=(replace(cells[0], metrics={**cells[0].metrics, ANGLE: None}), *cells[1:]))
    comparison = found(b)
    assert comparison.outcome == Outcome.NOT_COMPARABLE
    assert comparison.why == f"ik (pos+ori, sequence): {ANGLE} was measured on one side only in 1 of 8 cells"
    assert comparison.differences[0].clips == tuple(f"walk_{n:02}" for n in range(1, 8))


def test_cells_without_a_partner_are_named_and_may_be_allowed() -> None:
    more = side(clips=9)
    comparison = found(more)
    assert (comparison.only_a, comparison.only_b) == ((), ("ik on walk_08 (demo, seed 1)",))
    assert comparison.outcome == Outcome.NOT_COMPARABLE
    assert found(more, allow=["cells"]).outcome == found(more, allow=[EVERYTHING]).outcome == Outcome.PASS
    assert found(side(), more, allow=["cells"]).allowed == ("1 cell is only in A: ik on walk_08 (demo, seed 1)",)


def test_circumstances_that_differ_are_listed() -> None:
    a, b = (replace(side(), manifest=manifest(packages={"numpy": version})) for version in ("2.3", "2.4"))
    assert found(b, a).circumstances == (("packages.numpy", "2.3", "2.4"),)


@pytest.mark.parametrize(
    ("known", "said"),
    [
        ([{"walk_00": "Anna", "walk_01": "Bert", "walk_02": "Anna"}] * 2, "on 2 performers:"),
        ([None, {"walk_00": "Anna", "walk_01": "Anna", "walk_02": "Anna"}], "on 1 performer:"),
        ([{"walk_00": "Anna", "walk_01": "Anna"}] * 2, "on 2 units:"),
        ([None, None], "on 3 takes:"),
    ],
)
def test_the_headline_states_how_many_units_it_is_about(known: list[dict[str, str] | None], said: str) -> None:
    sides = [side(title, clips=3) for title in "AB"]
    a, b = (replace(s, manifest=replace(s.manifest, performers=who)) for s, who in zip(sides, known, strict=True))
    assert said in comparison_sentence(found(b, a))


def test_every_margin_is_of_a_metric_and_what_has_no_worse_is_refused() -> None:
    assert set(MARGINS) <= set(DEFINITIONS)
    for metric in ("jitter_true_m_s3", "lag_ms", "coverage", "nonsense"):
        with pytest.raises(UnknownName, match="metric with a margin"):
            found(side(), metrics=[metric])


def test_margins_follow_the_reference_down_to_a_floor() -> None:
    margin = MARGINS[ANGLE]
    assert margin.of(10.0) == pytest.approx(10.0 * margin.relative)
    assert margin.of(0.0) == margin.floor > 0.0
