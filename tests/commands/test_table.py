"""`harness table` as a user meets it: stdout is the table and nothing else."""

import csv
import json
from pathlib import Path

import pytest

from harness.cli import main
from tests.report.figures.made_up import ranked_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ranked_run(tmp_path_factory.mktemp("table") / "run")


@pytest.mark.parametrize(
    ("fmt", "first", "last"),
    [
        ("latex", r"% needs \usepackage{booktabs}", r"\end{tabular}"),
        ("markdown", "| method | clips | joint angle error [deg] | joint position error [mm] |", "harness compare."),
        ("csv", "method,joint_angle_mean_deg,", "mean_pose,"),
    ],
)
def test_stdout_is_the_table_and_the_word_goes_to_stderr(
    fmt: str, first: str, last: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["table", str(run), "--format", fmt]) == 0
    ended = capsys.readouterr()
    lines = ended.out.splitlines()
    assert lines[0].startswith(first)
    assert last in lines[-1]
    following, word = ended.err.splitlines()
    assert (following.split()[:3], word) == (["next:", "harness", "plot"], "pass")


def test_a_csv_has_a_line_for_each_method(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["table", str(run), "--format", "csv", "--metrics", "mpjpe_mm", "--methods", "ik,mean_pose"]) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert [row["method"] for row in rows] == ["ik", "mean_pose"]
    assert float(rows[0]["mpjpe_mm.low"]) < float(rows[0]["mpjpe_mm"]) < float(rows[0]["mpjpe_mm.high"])


def test_json_has_every_value(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["table", str(run), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["outcome"] == "pass"
    assert [row["method"] for row in said["rows"]] == ["expert_map", "twin_map", "ik", "mean_pose"]
    assert said["rows"][1]["values"][0]["standing"] == "tied"


def test_a_file_is_written_once(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["table", str(run), "--format", "latex", "--out", str(tmp_path / "t.tex")]
    assert main(words) == 0
    assert capsys.readouterr().out.splitlines() == [f"table: {tmp_path / 't.tex'}"]
    assert main(words) == 2
    ended = capsys.readouterr()
    assert ended.out == ""
    assert "exists" in ended.err
    assert ended.err.splitlines()[-1] == "refused"
    assert main([*words, "--force"]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--format latx", "Did you mean 'latex'?"),
        ("--metrics mpjpe_m", "Did you mean 'mpjpe_mm'?"),
        ("--methods ikk", "Did you mean 'ik'?"),
    ],
)
def test_what_is_refused_says_why(words: str, said: str, run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["table", str(run), *words.split()]) == 2
    ended = capsys.readouterr()
    assert ended.out == ""
    assert said in ended.err
