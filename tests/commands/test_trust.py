"""`harness trust` as a user meets it."""

from pathlib import Path

import pytest

from tests.command import Command
from tests.study.trust.conftest import SmallStudy, small_study, write_log

__all__ = ["small_study"]
pytestmark = pytest.mark.long


def test_the_plan_of_the_captures_passes(small_study: SmallStudy, tmp_path: Path, command: Command) -> None:
    words = small_study.plan, *small_study.captures, "--out", tmp_path / "out"
    said = command("trust", *words)
    assert said.lines[-1] == "pass"
    assert "every metric is equivalent" in said.out
    content = command("trust", *words, "--json").content
    assert content["outcome"] == "pass"
    assert content["out"] == str(tmp_path / "out")
    assert len(content["pairs"]) == 9


def test_another_plan_is_not_comparable_unless_exploratory(
    small_study: SmallStudy, tmp_path: Path, command: Command
) -> None:
    plan = small_study.another_plan("other.toml", "200.0", "150.0")
    words = plan, small_study.captures[0], "--out", tmp_path / "out"
    said = command("trust", *words, code=3)
    assert said.lines[-1] == "not comparable"
    assert "--exploratory" in said.err
    out = command("trust", *words, "--exploratory", code=3).out
    assert "\nExploratory: " in out
    assert "too few units: 1" in out


def test_truth_names_the_clips(small_study: SmallStudy, tmp_path: Path, command: Command) -> None:
    words = small_study.plan, small_study.captures[0], "--out", tmp_path / "out", "--truth"
    assert "another motion" in command("trust", *words, "golf_p1_01", code=2).err
    command("trust", *words, "walking_p1_01", code=3)


def test_a_plan_without_margins_is_refused(small_study: SmallStudy, tmp_path: Path, command: Command) -> None:
    plan = tmp_path / "plan.toml"
    plan.write_text('kind = "trust plan"\nscenario = "demo"\nmethods = ["ik"]\n', encoding="utf-8")
    assert "no margins" in command("trust", plan, small_study.captures[0], code=2).err


def test_poses_of_another_program_are_captures(small_study: SmallStudy, tmp_path: Path, command: Command) -> None:
    """Three seconds do not suffice to register them; the plan is accepted before."""
    poses, kept = write_log(small_study.captures[2], tmp_path / "poses.csv"), tmp_path / "poses.rec"
    words = "--truth", "boxing_p1_01", "--out", tmp_path / "out"
    assert "poses.csv names no plan" in command("trust", small_study.plan, poses, *words, code=3).err
    command("record", poses, kept, "--plan", small_study.plan)
    assert "overlap by at most" in command("trust", small_study.plan, kept, *words, code=3).err
    told = command("trust", small_study.plan, kept, "--truth", poses, *words[2:], code=2).err
    assert "no performer's motion" in told
    assert f"harness validate {kept} --truth {poses} --expect UNIT.toml" in told
