"""Declared training data: what shipped methods state, and the note beside the rank of a method from outside."""

import re
from pathlib import Path

import pytest

from harness.cli import main
from harness.core.split import training_note
from harness.reconstruct import list_methods, make_method
from harness.report.run.data import last_varied, read_summary_only, series_name
from harness.results import Manifest, read_summary

OUTSIDE = """
from harness.reconstruct.methods.mean_pose import MeanPose

class Silent(MeanPose):
    @property
    def training_data(self):
        raise AttributeError

class Corpus(MeanPose):
    training_data = "AMASS"
"""
SMALL = """schema = 1
methods = ["mean_pose", "theirs:Silent", "theirs:Corpus"]
noise = "clean"
[motion]
source = "builtin"
body = "common"
longest_s = 1.2
behaviours = ["walking"]
test = ["walking_p1_01"]
examples = ["walking_p2_01"]
[stations]
head = { bone = "head", along = 1.0 }
"""
NOTES = {"theirs:Silent": "training data unknown", "theirs:Corpus": "trained on AMASS"}


@pytest.mark.parametrize("name", [*list_methods(), "ik+ik", "ik:previous+ik", "mean_pose+ik"])
def test_every_shipped_method_declares_what_it_learns_from(name: str) -> None:
    method = make_method(name)
    assert method.training_data == ("examples" if method.needs_examples else "none")  # type: ignore[attr-defined]


def test_results_that_did_not_store_it_have_no_note() -> None:
    assert [training_note(text) for text in (None, "examples", "none", "unknown", "AMASS")] == [
        *("", "", ""),
        *("training data unknown", "trained on AMASS"),
    ]
    row = {"method": "theirs:Silent", "inputs": "pos", "split": "none", "performer": "", "lag": 0}
    assert series_name(row, [row]) == "theirs:Silent"
    assert Manifest({}, {}, {}).training_data == {}


@pytest.mark.long
def test_the_note_stands_beside_name_and_rank(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "theirs.py").write_text(OUTSIDE)
    (tmp_path / "small.toml").write_text(SMALL)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["run", "small.toml", "--out", "out", "--no-report"]) == 0
    said = capsys.readouterr().out
    for name, note in NOTES.items():
        assert re.search(rf"^walking +{name} \({note}\) ", said, re.MULTILINE)
    assert "mean_pose (" not in said
    assert {name: Manifest.read(Path("out/manifest.json")).training_data[name] for name in (*NOTES, "mean_pose")} == {
        **{"theirs:Silent": "unknown", "theirs:Corpus": "AMASS", "mean_pose": "examples"}
    }
    run = read_summary_only(Path("out"))
    named = {"mean_pose", *(f"{name} ({note})" for name, note in NOTES.items())}
    assert set(run.series) == named
    assert {run.series_of(row) for row in run.cells} == named
    assert last_varied(read_summary(Path("out")))["methods"][0]["training_data"] == "examples"
    for pair, noted in (("mean_pose,theirs:Silent", "B"), ("theirs:Silent,mean_pose", "A")):
        main(["compare", "out", "--methods", pair])
        assert f"training data: {noted}: theirs:Silent: training data unknown\n" in capsys.readouterr().out
