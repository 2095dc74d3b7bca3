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


def test_several_results_have_a_column_each(
    ranked: Path, conditions: Path, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run, its baseline by name, and a run of other methods and conditions."""
    monkeypatch.chdir(tmp_path)
    command("baseline", "save", "kept", ranked)
    words = ("table", f"old={ranked}", "kept", f"other={conditions}", "--metrics", "mpjpe_mm,jitter_m_s3")
    rows = list(csv.DictReader(command(*words, "--format", "csv").lines))
    alone = list(csv.DictReader(command("table", ranked, "--format", "csv", "--metrics", "mpjpe_mm").lines))
    assert [row["method"] for row in rows[:4]] == [row["method"] for row in alone]
    for part in ("", ".low", ".high", ".clips", ".standing"):
        assert [row[f"old{part}"] for row in rows[:4]] == [row[f"kept{part}"] for row in rows[:4]]
        assert [row[f"old{part}"] for row in rows[:4]] == [row[f"mpjpe_mm{part}"] for row in alone]
    assert {row["other"] for row in rows[:4]} == {""}
    assert {row["metric"] for row in rows} == {"mpjpe_mm", "jitter_m_s3"}
    assert {(row["noise"], row["performers"]) for row in rows if row["other"]} == {
        (noise, performer) for noise in ("clean", "default") for performer in ("known", "new")
    }
    assert command(*words).lines[0] == "| metric | noise | performers | method | clips | old | kept | other |"
    assert r"joint position error [mm] & \-- & ".replace("\\-- & ", "") in command(*words, "--format", "latex").out
    assert command(*words, "--json").content["results"] == ["old", "kept", "other"]
    assert "is named 2 times" in command("table", ranked, ranked, code=2).err
