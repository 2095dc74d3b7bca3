"""Which condition and which methods a figure of frames shows."""

from pathlib import Path

import pytest

from harness.errors import BadInput, UnknownName
from harness.report.figures.conditions import choose_condition, rank_highlights, read_conditions, read_series
from harness.report.figures.print_figure import FigureSelection
from harness.results.reader import ResultSet
from tests.compare.sides import cell, manifest, side, write_run


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
