"""Tables of findings: the RMS stands beside the mean, and RMS of joint groups are roots of mean squares."""

from types import SimpleNamespace
from typing import Any

import pytest

from harness.study.papers.tables import RMS, UnitErrors, errors_by_joint_group, errors_by_unit, format_mean, mean_table

MEANS = {"a": 1.0, "b": 2.0}
WITH_RMS = UnitErrors(MEANS)
WITH_RMS.rms = {"a": 2.0, "b": 4.0}


def test_the_rms_follows_mean_and_spread() -> None:
    assert format_mean(MEANS) == "1.50 ± 0.71 (2)"
    assert format_mean(WITH_RMS) == "1.50 ± 0.71, RMS 3.00 (2)"
    assert format_mean(UnitErrors()) == "not measured"


def test_a_table_says_whether_it_has_the_rms() -> None:
    table = mean_table("Error", "walks", {"all": {"ik": WITH_RMS, "other": {}}})
    assert table.title == "Error: mean ± sd, RMS over units (units)"
    assert table.rows == (("all", "1.50 ± 0.71, RMS 3.00 (2)", "not measured"),)
    assert mean_table("Error", "walks", {"all": {"ik": MEANS}}).title == "Error: mean ± sd over units (units)"


def test_the_rms_of_a_group_is_the_root_of_the_mean_square_of_its_hinges() -> None:
    hinges = {"lfoot.rx": 3.0, "rfoot.rx": 4.0, "head.rx": 100.0}
    scores = SimpleNamespace(per_joint={"joint_angle_mean_deg": hinges, RMS: hinges})
    cell: Any = {"unit": "a", "unit_clips": 1}, SimpleNamespace(scores=scores)
    groups = {"feet": ("lfoot", "rfoot")}
    feet = errors_by_joint_group([cell], groups)["feet"]
    assert feet["a"] == pytest.approx(3.5)
    assert feet.rms == pytest.approx({"a": 12.5**0.5})


def test_a_unit_is_the_mean_of_its_clips_and_is_left_out_where_one_lacks() -> None:
    kind = {"method": "ik", "inputs": "pos", "split": "sequence", "performer": "new", "varied": {}, "lag": 0}
    rows = [
        {**kind, "behaviour": "walking", "clip": clip, "unit": unit, "unit_clips": 2, "joint_angle_mean_deg": error}
        for clip, unit, error in (
            ("a", "13", 1.0),
            ("b", "13", 3.0),
            ("c", "14", 5.0),
            ("d", "14", None),
        )
    ]
    assert errors_by_unit(rows) == {"13": 2.0}
    assert errors_by_unit([{**row, RMS: 3.0} for row in rows]).rms == {"13": 3.0, "14": 3.0}
    assert errors_by_unit(rows[:3]) == {"13": 2.0}
