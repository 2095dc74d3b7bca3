"""`harness plot` and `harness table` as a user meets them."""

import csv
from pathlib import Path

import pytest

from tests.command import Command
from tests.compare.sides import side, write_run
from tests.report.figures.made_up import ranked_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ranked_run(tmp_path_factory.mktemp("plot") / "run")


def test_it_names_the_file_its_size_and_a_caption(
    run: Path, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    lines = command("plot", run, "--out", "r.svg", "--methods", "ik,expert_map", "--width", "170").lines
    assert lines[0].startswith("figure: r.svg (170 x ")
    assert lines[1].startswith("caption: Mean joint angle error on 15 clips. Lines: 95 % intervals over units.")
    assert lines[-1] == "pass"
    assert Path("r.svg").is_file()
    assert "r.svg exists." in command("plot", run, "--out", "r.svg", code=2).err
    said = command("plot", run, "--out", "r.svg", "--force", "--json").content
    assert (said["path"], said["kind"], said["width_mm"], said["outcome"]) == ("r.svg", "ranking", 85.0, "pass")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("plot --kind rankin", "Did you mean 'ranking'?"),
        ("plot --metric mpjpe_m", "Did you mean 'mpjpe_mm'?"),
        ("plot --methods ikk", "Did you mean 'ik'?"),
        ("plot --kind time --clip walk_1", "Did you mean 'walk_"),
        ("plot --kind time --control ikk", "Did you mean 'ik'?"),
        ("plot --kind placement", "It is for a placement study."),
        ("plot --width 100", "Choose 85 or 170 mm."),
        ("plot --condition noise=clean", "no condition of the run called 'noise=clean'. Known: none."),
        ("table --format latx", "Did you mean 'latex'?"),
        ("table --metrics mpjpe_m", "Did you mean 'mpjpe_mm'?"),
        ("table --methods ikk", "Did you mean 'ik'?"),
    ],
)
def test_what_is_refused_says_why(words: str, said: str, run: Path, tmp_path: Path, command: Command) -> None:
    verb, *flags = words.split()
    ended = command(verb, run, "--out", tmp_path / "x", *flags, code=2)
    assert ended.out == ("refused\n" if verb == "plot" else "")
    assert said in ended.err.splitlines()[0]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("failed", "code", "word"), [((), 3, "not comparable"), (("ik on walk_1",), 4, "incomplete")])
def test_a_run_without_a_measured_cell_ends_as_the_run_did(
    failed: tuple[str, ...], code: int, word: str, tmp_path: Path, command: Command
) -> None:
    out = write_run(tmp_path / "run", side(metrics={"joint_angle_mean_deg": None}, failed=failed))
    for verb in ("plot", "table"):
        ended = command(verb, out, code=code)
        assert word in ended.out + ended.err
        assert "no cell was measured" in ended.err


@pytest.mark.parametrize(
    ("fmt", "first", "last"),
    [
        ("latex", r"% needs \usepackage{booktabs}", r"\end{tabular}"),
        ("markdown", "| method | clips | joint angle error [deg] | joint position error [mm] |", "harness compare."),
        ("csv", "method,joint_angle_mean_deg,", "mean_pose,"),
    ],
)
def test_stdout_is_the_table_and_the_word_goes_to_stderr(
    fmt: str, first: str, last: str, run: Path, command: Command
) -> None:
    ended = command("table", run, "--format", fmt)
    lines = ended.out.splitlines()
    assert lines[0].startswith(first)
    assert last in lines[-1]
    following, word = ended.err.splitlines()
    assert (following.split()[:3], word) == (["next:", "harness", "plot"], "pass")


def test_a_csv_has_a_line_for_each_method(run: Path, command: Command) -> None:
    words = ("--format", "csv", "--metrics", "mpjpe_mm", "--methods", "ik,mean_pose")
    rows = list(csv.DictReader(command("table", run, *words).lines))
    assert [row["method"] for row in rows] == ["ik", "mean_pose"]
    assert float(rows[0]["mpjpe_mm.low"]) < float(rows[0]["mpjpe_mm"]) < float(rows[0]["mpjpe_mm.high"])


def test_json_has_every_value(run: Path, command: Command) -> None:
    said = command("table", run, "--json").content
    assert said["outcome"] == "pass"
    assert [row["method"] for row in said["rows"]] == ["expert_map", "twin_map", "ik", "mean_pose"]
    assert said["rows"][1]["values"][0]["standing"] == "tied"


def test_a_file_is_written_once(run: Path, tmp_path: Path, command: Command) -> None:
    words = ["table", str(run), "--format", "latex", "--out", str(tmp_path / "t.tex")]
    assert command(*words).lines == [f"table: {tmp_path / 't.tex'}"]
    ended = command(*words, code=2)
    assert ended.out == ""
    assert "exists" in ended.err
    assert ended.err.splitlines()[-1] == "refused"
    command(*words, "--force")
