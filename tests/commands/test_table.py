"""`harness table` as a user meets it."""

import csv
from pathlib import Path

import pytest

from tests.command import Command


@pytest.mark.parametrize(
    ("fmt", "first", "last"),
    [
        ("latex", r"% needs \usepackage{booktabs}", r"\end{tabular}"),
        ("markdown", "| method | clips | joint angle error [deg] | joint position error [mm] |", "harness compare."),
        ("csv", "method,joint_angle_mean_deg,", "mean_pose,"),
    ],
)
def test_stdout_is_the_table_and_the_word_goes_to_stderr(
    fmt: str, first: str, last: str, ranked: Path, command: Command
) -> None:
    ended = command("table", ranked, "--format", fmt)
    lines = ended.out.splitlines()
    assert lines[0].startswith(first)
    assert last in lines[-1]
    following, word = ended.err.splitlines()
    assert (following.split()[:3], word) == (["next:", "harness", "plot"], "pass")


def test_a_csv_has_a_line_for_each_method(ranked: Path, command: Command) -> None:
    words = ("--format", "csv", "--metrics", "mpjpe_mm", "--methods", "ik,mean_pose")
    rows = list(csv.DictReader(command("table", ranked, *words).lines))
    assert [row["method"] for row in rows] == ["ik", "mean_pose"]
    assert float(rows[0]["mpjpe_mm.low"]) < float(rows[0]["mpjpe_mm"]) < float(rows[0]["mpjpe_mm.high"])


def test_json_has_every_value(ranked: Path, command: Command) -> None:
    said = command("table", ranked, "--json").content
    assert said["outcome"] == "pass"
    assert [row["method"] for row in said["rows"]] == ["expert_map", "twin_map", "ik", "mean_pose"]
    assert said["rows"][1]["values"][0]["standing"] == "tied"


def test_a_file_is_written_once(ranked: Path, tmp_path: Path, command: Command) -> None:
    words = ["table", str(ranked), "--format", "latex", "--out", str(tmp_path / "t.tex")]
    assert command(*words).lines == [f"table: {tmp_path / 't.tex'}"]
    ended = command(*words, code=2)
    assert ended.out == ""
    assert "exists" in ended.err
    assert ended.err.splitlines()[-1] == "refused"
    command(*words, "--force")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--format latx", "Did you mean 'latex'?"),
        ("--metrics mpjpe_m", "Did you mean 'mpjpe_mm'?"),
        ("--methods ikk", "Did you mean 'ik'?"),
    ],
)
def test_what_is_refused_says_why(words: str, said: str, ranked: Path, tmp_path: Path, command: Command) -> None:
    ended = command("table", ranked, "--out", tmp_path / "x", *words.split(), code=2)
    assert ended.out == ""
    assert said in ended.err.splitlines()[0]
    assert not list(tmp_path.iterdir())
