"""The quick form: few short clips of each behaviour with the whole database, in a folder and tables of its own."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from harness.cli import main
from harness.errors import BadInput, Outcome
from harness.results.findings import read_findings
from harness.study.papers.paper import PAPERS, load_paper, reproduce
from harness.study.papers.paper_study import CLIPS, LONGEST_S, PaperStudy, count_cells, shorten_scenario
from tests.study.papers.tiny import TINY, WALKS


@pytest.mark.parametrize("name", PAPERS)
@pytest.mark.parametrize("motion", ["builtin", "cmu"])
def test_each_behaviour_keeps_two_short_clips_and_its_database(name: str, motion: str) -> None:
    plan = load_paper(name).plan("cmu" if motion == "cmu" else "builtin", 1)
    for scenario in plan.values():
        full, quick = scenario.motion, shorten_scenario(scenario).motion
        assert Counter(quick.behaviours) == dict.fromkeys(full.behaviours, CLIPS)
        assert set(quick.test) <= set(full.test)
        assert 0.0 < quick.longest_s <= LONGEST_S
        assert (quick.examples, quick.withheld, quick.split) == (full.examples, full.withheld, full.split)
    quickly = count_cells({run: shorten_scenario(scenario) for run, scenario in plan.items()})
    assert quickly < 0.25 * count_cells(plan)


def test_the_quick_form_is_another_study(tmp_path: Path) -> None:
    three = replace(WALKS, motion=replace(WALKS.motion, test=(*WALKS.motion.test, "walking_p3_01")))
    paper = replace(TINY, runs=(three,), experiments={"walks": TINY.experiments["walks"]})
    findings, outcome = reproduce(paper, tmp_path / "out", quick=True)
    assert outcome is Outcome.PASS
    assert findings.motion == "built-in performer, quick form"
    assert findings.experiments[0].notes == ("4 cells", "Units of the statistics: walks: 2 performers.")  # of three
    with pytest.raises(BadInput, match="quick form"):
        reproduce(paper, tmp_path / "out")


def test_one_experiment_runs_alone_and_the_rest_completes_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paper = replace(TINY, runs_of={"walks": ("walks",), "bouts": ("bouts",)})
    monkeypatch.setattr("harness.study.papers.paper.load_paper", lambda name: paper)
    words = ["paper", "liu2011", "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main([*words, "--only", "bouts"]) == 0
    assert [each.name for each in read_findings(tmp_path / "out" / "findings.json").experiments] == ["bouts"]
    assert not (tmp_path / "out" / "walks").exists()
    kept = {path.name for path in (tmp_path / "out" / "bouts" / "cells").iterdir()}
    assert main(words) == 0
    assert [each.name for each in read_findings(tmp_path / "out" / "findings.json").experiments] == ["walks", "bouts"]
    assert {path.name for path in (tmp_path / "out" / "bouts" / "cells").iterdir()} == kept
    assert PaperStudy(tmp_path / "out", "builtin", 1, TINY.plan("builtin", 1)).rows("walks")


def test_an_experiment_that_does_not_exist_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["paper", "liu2011", "--out", str(tmp_path / "out"), "--only", "eigenmode"]) == 2
    assert "Did you mean 'eigenmodes'?" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
