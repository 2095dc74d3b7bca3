"""`harness placement` as a user asks it: a question without a file, its answer, and what is refused."""

from pathlib import Path

import pytest

from harness.results.findings import read_placement
from harness.study.placement import question
from tests.command import Command

ONE_STATION = "tests.study.placement.one_station:OneStation"


@pytest.mark.long
def test_a_question_is_answered_alike_on_the_terminal_the_page_and_in_json(
    tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With clips of 1.5 s, of which seven are held out."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(question, "CLIP_S", 1.5)
    monkeypatch.setattr(question, "DEFAULT_CLIPS", 7)
    words = ["placement", "--stations", "1", "--behaviour", "boxing", "--places", "hand,pelvis", "--clips", "7"]
    words += ["--method", ONE_STATION, "--noise", "clean", "--jobs", "1"]
    ended = command(*words)
    out = Path("results/placement_boxing_1")
    findings = read_placement(out / "findings.json")
    answer = ended.out.splitlines()[-2]
    best = findings.best[0]
    assert answer.startswith(f"Best station for boxing: {best.stations[0].replace('_', ' ')}, ")
    assert "on 7 held-out units" in answer
    assert " ".join(ended.out.split()).startswith(answer)
    assert f"<h1>{answer}</h1>" in (out / "report.html").read_text(encoding="utf-8")
    announced = ended.err.splitlines()
    assert announced[0] == "Within 10 minutes: every one of 3 sets, on 7 clips."
    assert announced[1].startswith("7 units can show a difference of ")
    assert announced[-1] == f"next: harness plot {out}"
    assert findings.power is not None
    assert (findings.power.clips, findings.power.sets, findings.sizes) == (7, 3, (1,))
    assert (findings.noise, best.of, best.held_out_clips) == ("clean", 3, 7)
    cells = {folder.name for folder in (out / "cells").iterdir()}
    assert len(cells) == 3 * 7 + 7
    said = command(*words, "--json").content
    assert (said["answer"], said["sizes"], said["outcome"]) == (answer, [1], "pass")
    assert {folder.name for folder in (out / "cells").iterdir()} == cells


@pytest.mark.slow
def test_without_the_time_for_every_set_stations_are_added_one_after_another(
    tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["placement", "--stations", "2", "--behaviour", "golf", "--places", "head,torso,hand,ankle,pelvis"]
    ended = command(*words, "--minutes", "0.001", "--method", ONE_STATION, "--noise", "clean", "--jobs", "1")
    assert "one station after another, the best next one each time, on 6 clips" in ended.err
    assert "6 units cannot show any difference between 7 sets, 8 might" in ended.err
    findings = read_placement(Path("results/placement_golf_2/findings.json"))
    assert [len(step.stations) for step in findings.searches[0].steps] == [1, 2]
    assert not findings.rankings
    assert findings.notes[0].startswith("Within 0.001 minutes: one station after another")
