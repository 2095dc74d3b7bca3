"""The table of a run: its means are those of the summary, its intervals over clips, its marks those of the ranking."""

from pathlib import Path

import numpy as np
import pytest

from harness.compare import mean_interval
from harness.errors import BadFile, UnknownName
from harness.report.figures.conditions import read_conditions
from harness.report.figures.table import MetricValue, build_table
from harness.results import read_summary
from tests.compare.sides import side, write_run

ANGLE = "joint_angle_mean_deg"


def test_means_are_those_of_the_summary(framed: Path) -> None:
    table = build_table(framed, (ANGLE, "mpjpe_mm", "step_p50_ms"))
    assert table.condition_names == ("noise",)
    summary = {(row["varied"]["noise"], row["method"]): row["metrics"] for row in read_summary(framed)["methods"]}
    assert [(row.condition[0], row.method) for row in table.rows] == list(summary)
    for row in table.rows:
        for value in row.values:
            assert value.mean == pytest.approx(summary[row.condition[0], row.method][value.metric]["mean"])
        assert row.clips == 2


def test_intervals_are_over_clips(ranked: Path) -> None:
    values = read_conditions(ranked).conditions[0].values()
    for row in build_table(ranked).rows:
        by_clip = np.array(list(values[row.method][ANGLE].values()))
        assert (row.values[0].low, row.values[0].high) == mean_interval(by_clip)
        assert row.values[0].clips == 8


def test_the_lowest_and_what_is_tied_with_it_are_bold(ranked: Path) -> None:
    table = build_table(ranked, (ANGLE, "jitter_m_s3"))
    standings = {row.method: [(value.standing, value.bold) for value in row.values] for row in table.rows}
    unranked = ("", False)
    assert standings == {
        "expert_map": [("lowest", True), unranked],
        "twin_map": [("tied", True), unranked],
        "ik": [("worse", False), unranked],
        "mean_pose": [("worse", False), unranked],
    }
    assert "Bold: the lowest mean and those tied with it" in table.note
    assert "Fewer than" not in table.note


def test_few_clips_make_nothing_bold(framed: Path) -> None:
    table = build_table(framed)
    assert {value.standing for row in table.rows for value in row.values} == {"lowest", "tied"}
    assert not any(value.bold for row in table.rows for value in row.values)
    assert "2 clips of 2 performers." in table.note
    assert "Fewer than 6 units" in table.note
    assert "Bold" not in table.note


def test_nothing_is_bold_where_all_are_tied(tmp_path: Path) -> None:
    out = write_run(tmp_path / "run", side(methods={"a": 1.0, "b": 1.0}))
    assert not any(value.bold for row in build_table(out).rows for value in row.values)


def test_conditions_and_behaviours_have_columns(conditions: Path, viewed: Path) -> None:
    table = build_table(conditions)
    assert table.condition_names == ("noise", "performers")
    found = [("clean", "known"), ("clean", "new"), ("default", "known"), ("default", "new")]
    assert list(dict.fromkeys(row.condition for row in table.rows)) == found
    by_behaviour = build_table(conditions, condition="noise=clean, known performers", by_behaviour=True)
    assert by_behaviour.condition_names == ("noise", "behaviour")
    assert [row.condition for row in by_behaviour.rows] == [("clean", "jumping")] * 2
    assert {row.clips for row in by_behaviour.rows} == {6}
    several = build_table(viewed, by_behaviour=True).rows
    assert [row.condition for row in several] == [("walking",)] * 3 + [("boxing",)] * 3
    assert {row.clips for row in several} == {1}


def test_methods_stand_in_the_order_of_their_names(ranked: Path) -> None:
    assert [row.method for row in build_table(ranked, methods=["ik", "expert_map"]).rows] == ["ik", "expert_map"]


def test_what_was_not_measured_is_a_dash(tmp_path: Path) -> None:
    (row,) = build_table(write_run(tmp_path / "run", side()), ("mpjpe_pa_mm", ANGLE)).rows
    assert row.values[0] == MetricValue("mpjpe_pa_mm", None)
    assert row.values[0].formatted() == ("–", "")
    assert row.clips == 8
    one = build_table(write_run(tmp_path / "one", side(clips=1))).rows[0].values[0]
    assert (one.low, one.high, one.formatted()[1]) == (None, None, "")


def test_unknown_metrics_and_other_folders_are_refused(ranked: Path, placement_study: Path) -> None:
    with pytest.raises(UnknownName, match="Did you mean 'mpjpe_mm'"):
        build_table(ranked, ("mpjpe_m",))
    with pytest.raises(BadFile, match="a placement study; expected a run"):
        build_table(placement_study)
