"""`harness trust` as a user meets it."""

import json
from pathlib import Path
from typing import Any

import pytest

from harness.cli import main
from tests.study.trust.conftest import SmallStudy, small_study

__all__ = ["small_study"]
pytestmark = pytest.mark.long


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command."""
    capsys.readouterr()
    code = main(["trust", *map(str, words)])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def test_the_plan_of_the_captures_passes(
    small_study: SmallStudy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = small_study.plan, *small_study.captures, "--out", tmp_path / "out"
    code, out, _ = run(capsys, *words)
    assert (code, out.splitlines()[-1]) == (0, "pass")
    assert "Every metric is equivalent" in out
    code, out, _ = run(capsys, *words, "--json", "--jobs", 2)
    content: dict[str, Any] = json.loads(out)
    assert (code, content["outcome"]) == (0, "pass")
    assert content["out"] == str(tmp_path / "out")
    assert len(content["pairs"]) == 9


def test_another_plan_is_not_comparable_unless_exploratory(
    small_study: SmallStudy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = small_study.another_plan("other.toml", "200.0", "150.0")
    words = plan, small_study.captures[0], "--out", tmp_path / "out"
    code, out, err = run(capsys, *words)
    assert (code, out.splitlines()[-1]) == (3, "not comparable")
    assert "--exploratory" in err
    code, out, _ = run(capsys, *words, "--exploratory")
    assert code == 3
    assert "\nExploratory: " in out
    assert "too few units: 1" in out


def test_truth_names_the_clips(small_study: SmallStudy, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = small_study.plan, small_study.captures[0], "--out", tmp_path / "out", "--truth"
    code, _, err = run(capsys, *words, "golf_p1_01")
    assert (code, "another motion" in err) == (2, True)
    assert run(capsys, *words, "walking_p1_01")[0] == 3


def test_a_plan_without_margins_is_refused(
    small_study: SmallStudy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = tmp_path / "plan.toml"
    plan.write_text('kind = "trust plan"\nscenario = "demo"\nmethods = ["ik"]\n', encoding="utf-8")
    code, _, err = run(capsys, plan, small_study.captures[0])
    assert (code, "no margins" in err) == (2, True)
