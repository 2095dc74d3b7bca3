"""`harness placement` as a user asks it: a question without a file, its answer, and what is refused."""

import json
from pathlib import Path

import pytest

from harness.cli import main
from harness.results.placement_findings import read_placement

ONE_STATION = "tests.study.placement.one_station:OneStation"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "Neither a study nor a question. Type: harness placement --stations 3 --behaviour table_tennis"),
        ("walking --stations 3", "--stations with the study walking. A study has its own"),
        ("--stations 3 --places hand_r,head", "no place called 'hand_r'. Did you mean 'hand'?"),
        ("--stations 3 --places head,,hand", "--places 'head,,hand' has an empty name."),
        ("--behaviour table_tenis", "no behaviour called 'table_tenis'. Did you mean 'table_tennis'?"),
        ("--behaviour ,", "--behaviour ',' has an empty name."),
        ("--stations 4 --places head,hand", "4 to 4 stations of 3 places."),
        ("--stations 1 --method ikk", "no method called 'ikk'"),
    ],
)
def test_what_is_refused_says_why_and_writes_nothing(
    words: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["placement", *words.split()]) == 2
    ended = capsys.readouterr()
    assert ended.out.splitlines() == ["refused"]
    assert said in ended.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["x", "2-", "-3", "1-2-3", ""])
def test_a_number_of_stations_is_a_number_or_a_range(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["placement", f"--stations={text}"])
    assert "is no number of stations" in capsys.readouterr().err


@pytest.mark.long
def test_a_question_is_answered_alike_on_the_terminal_the_page_and_in_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["placement", "--stations", "1", "--behaviour", "boxing", "--places", "hand,pelvis", "--clips", "7"]
    words += ["--method", ONE_STATION, "--noise", "clean", "--jobs", "1"]
    assert main(words) == 0
    ended = capsys.readouterr()
    out = Path("results/placement_boxing_1")
    findings = read_placement(out / "findings.json")
    answer = ended.out.splitlines()[-2]
    best = findings.best[0]
    assert answer.startswith(f"Best station for boxing: {best.stations[0].replace('_', ' ')}, ")
    assert "on 16 held-out units" in answer
    assert " ".join(ended.out.split()).startswith(answer)
    assert f"<h1>{answer}</h1>" in (out / "report.html").read_text(encoding="utf-8")
    announced = ended.err.splitlines()
    assert announced[0] == "Within 10 minutes: every one of 3 sets, on 7 clips."
    assert announced[1].startswith("7 units can show a difference of ")
    assert announced[-1] == f"next: harness plot {out}"
    assert findings.power is not None
    assert (findings.power.clips, findings.power.sets, findings.sizes) == (7, 3, (1,))
    assert (findings.noise, best.of, best.held_out_clips) == ("clean", 3, 16)
    cells = {folder.name for folder in (out / "cells").iterdir()}
    assert len(cells) == 3 * 7 + 16
    assert main([*words, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["answer"], said["sizes"], said["outcome"]) == (answer, [1], "pass")
    assert {folder.name for folder in (out / "cells").iterdir()} == cells


@pytest.mark.slow
def test_without_the_time_for_every_set_stations_are_added_one_after_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["placement", "--stations", "2", "--behaviour", "golf", "--places", "head,torso,hand,ankle,pelvis"]
    assert main([*words, "--minutes", "0.001", "--method", ONE_STATION, "--noise", "clean", "--jobs", "1"]) == 0
    ended = capsys.readouterr()
    assert "one station after another, the best next one each time, on 6 clips" in ended.err
    assert "6 units cannot show any difference between 7 sets, 8 might" in ended.err
    findings = read_placement(Path("results/placement_golf_2/findings.json"))
    assert [len(step.stations) for step in findings.searches[0].steps] == [1, 2]
    assert not findings.rankings
    assert findings.notes[0].startswith("Within 0.001 minutes: one station after another")
