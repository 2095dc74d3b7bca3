"""Conditions of a run: which there are, how they are chosen and ranked; which condition and methods a figure shows."""

import shutil
from pathlib import Path

import pytest

from harness.errors import BadFile, BadInput, NothingMeasured, Outcome, UnknownName
from harness.report.figures.conditions import (
    check_metric,
    choose_condition,
    describe_absent,
    rank_highlights,
    read_conditions,
    read_series,
)
from harness.report.figures.print_figure import FigureSelection
from harness.report.run.ranking import describe_rankings
from harness.results import ResultSet, read_summary
from tests.compare.sides import cell, manifest, side, write_run
from tests.planted import MeansPlan, Plan, planted_means_run, planted_run


def test_a_run_of_one_condition_needs_no_name(ranked: Path) -> None:
    (only,) = read_conditions(ranked).conditions
    assert only.name == ""
    assert only.series == ("expert_map", "twin_map", "ik", "mean_pose")
    assert len(only.clips) == 8


def test_varied_values_and_performers_are_conditions(conditions: Path) -> None:
    run = read_conditions(conditions)
    names = [f"noise={noise}, {who} performers" for noise in ("clean", "default") for who in ("known", "new")]
    assert [each.name for each in run.conditions] == names
    assert [len(each.clips) for each in run.conditions] == [6, 2, 6, 2]
    for each in run.conditions:
        assert {row["performer"] for row in each.cells} == {each.group.performer}
        assert {row["noise"] for row in each.cells} == {each.setting["noise"]}
    assert [each.name for each in run.select("noise=clean").conditions] == names[:2]
    assert [each.name for each in run.select("new performers, noise=default").conditions] == names[3:]
    with pytest.raises(UnknownName, match=r"no condition of the run called 'noise=cleen'\. Did you mean 'noise=clean'"):
        run.select("noise=cleen")


def test_each_lag_is_a_condition(tmp_path: Path) -> None:
    plan = Plan(("walking",), {"ik": 1.0, "late": 0.5}, duration_s=2.0, lags={"late": 2})
    run = read_conditions(planted_run(tmp_path / "run", plan))
    assert [each.name for each in run.conditions] == ["no lag", "a lag of 2 frames"]
    assert [each.series for each in run.conditions] == [("ik",), ("late (lag 2)",)]


def test_methods_are_chosen_in_the_order_of_their_names(ranked: Path) -> None:
    run = read_conditions(ranked).select(methods=["mean_pose", "ik"])
    assert run.conditions[0].series == ("mean_pose", "ik")
    ranking = run.conditions[0].rank()
    assert ranking is not None
    assert list(ranking.values) == ["ik", "mean_pose"]
    with pytest.raises(UnknownName, match="Did you mean 'expert_map'"):
        read_conditions(ranked).select(methods=["expert_mapp"])


def test_the_ranking_is_that_of_the_terminal(ranked: Path) -> None:
    ((text, lowest),) = describe_rankings(read_summary(ranked), "motion")
    ranking = read_conditions(ranked).conditions[0].rank()
    assert ranking is not None
    assert ranking.lowest == lowest == "expert_map"
    assert ranking.others("better") == ["ik", "mean_pose"]
    assert "It is better than ik, mean_pose." in text
    assert "Cannot tell whether it is better than twin_map" in text


@pytest.mark.parametrize(("failing", "outcome"), [((), Outcome.NOT_COMPARABLE), (("late",), Outcome.INCOMPLETE)])
def test_a_run_without_a_measured_cell_has_the_outcome_of_the_run(
    failing: tuple[str, ...], outcome: Outcome, tmp_path: Path
) -> None:
    methods = dict.fromkeys(("ik", *failing), 1.0)
    planted_means_run(tmp_path / "run", MeansPlan(("jumping",), 1, methods, failing=failing, unmeasured=("ik",)))
    with pytest.raises(NothingMeasured, match="no cell was measured") as refused:
        read_conditions(tmp_path / "run")
    assert refused.value.outcome is outcome


def test_cells_that_failed_are_counted(ranked: Path, tmp_path: Path) -> None:
    plan = MeansPlan(("jumping",), 2, {"ik": 1.0, "late": 2.0}, failing=("late",))
    run = read_conditions(planted_means_run(tmp_path / "run", plan))
    assert run.missing_note == " 2 of 4 planned cells were not measured."
    assert read_conditions(ranked).missing_note == ""


def test_a_damaged_summary_is_refused(ranked: Path, tmp_path: Path) -> None:
    out = shutil.copytree(ranked, tmp_path / "run")
    (out / "summary.json").write_text("{}")
    with pytest.raises(BadFile):
        read_conditions(out)


def test_what_a_figure_cannot_show_is_named() -> None:
    assert describe_absent(["a", "b", "c"], ["b"]) == " Not measured: a, c."
    assert describe_absent(["a"], ["a"]) == ""


def test_a_metric_that_does_not_fit_is_told_from_one_that_does_not_exist() -> None:
    check_metric("mpjpe_mm", ("mpjpe_mm",), "metric that ranks methods")
    with pytest.raises(UnknownName, match="Did you mean 'mpjpe_mm'"):
        check_metric("mpjpe_m", ("mpjpe_mm",), "metric that ranks methods")
    with pytest.raises(BadInput, match="lag_ms is no metric that ranks methods"):
        check_metric("lag_ms", ("mpjpe_mm",), "metric that ranks methods")


def test_the_last_values_and_known_performers_are_shown_unless_a_clip_is_named(conditions: Path) -> None:
    run = read_conditions(conditions)
    assert choose_condition(run, FigureSelection()).name == "noise=default, known performers"
    assert choose_condition(run, FigureSelection(clip="jumping_p7_01")).name == "noise=default, new performers"
    assert choose_condition(run.select("noise=clean"), FigureSelection()).name == "noise=clean, known performers"
    with pytest.raises(UnknownName, match=r"no clip of the run called 'jumping_p7'\. Did you mean 'jumping_p7_01'"):
        choose_condition(run, FigureSelection(clip="jumping_p7"))


def test_the_leader_is_shown_against_ik_or_the_named_control(ranked: Path) -> None:
    run = read_conditions(ranked)
    (condition,) = run.conditions
    shown = rank_highlights(condition, FigureSelection())
    assert (shown.leader, shown.control) == ("expert_map", "ik")
    assert [shown.role(name) for name in ("expert_map", "ik", "twin_map")] == [" (lowest mean)", " (control)", ""]
    assert rank_highlights(condition, FigureSelection(control="mean_pose")).control == "mean_pose"
    with pytest.raises(UnknownName, match="Did you mean 'mean_pose'"):
        rank_highlights(condition, FigureSelection(control="mean_pos"))
    with pytest.raises(UnknownName):
        rank_highlights(condition, FigureSelection(control="expert_map"))


def test_without_ik_the_control_is_the_second_and_one_method_has_none(ranked: Path) -> None:
    run = read_conditions(ranked)
    without = rank_highlights(run.select(methods=["mean_pose", "twin_map"]).conditions[0], FigureSelection())
    assert (without.leader, without.control) == ("twin_map", "mean_pose")
    assert rank_highlights(run.select(methods=["ik"]).conditions[0], FigureSelection()).control is None


def test_a_control_may_be_a_method_with_several_inputs(tmp_path: Path) -> None:
    results = [side(methods={"ik": 2.0, "expert_map": 1.0}, inputs=inputs) for inputs in ("pos", "ori")]
    cells = tuple(each for result in results for each in result.cells)
    out = write_run(tmp_path / "run", ResultSet("A", manifest(), cells, len(cells)))
    (condition,) = read_conditions(out).conditions
    assert rank_highlights(condition, FigureSelection()).control is not None


def test_methods_without_a_common_clip_have_no_leader(tmp_path: Path) -> None:
    cells = (cell("a", "ik"), cell("b", "expert_map"))
    out = write_run(tmp_path / "run", ResultSet("A", manifest(), cells, 2))
    with pytest.raises(BadInput, match="share no measured clip"):
        rank_highlights(read_conditions(out).conditions[0], FigureSelection())


def test_traces_are_those_of_the_condition(framed: Path) -> None:
    run = read_conditions(framed)
    means = []
    for condition in run.conditions:
        series = read_series(framed, condition, lambda name, _: name == "ik")
        assert list(series) == ["ik"]
        assert sorted(trace.clip for trace in series["ik"]) == sorted(condition.clips)
        means.append(sum(float(trace.rotation_deg.mean()) for trace in series["ik"]))
    assert means[1] == pytest.approx(2.0 * means[0], rel=0.05)
