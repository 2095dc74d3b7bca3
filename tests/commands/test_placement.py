"""`harness placement` as a user asks it: a question without a file, its answer, and what is refused."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from harness.errors import Outcome
from harness.results.findings import read_placement
from harness.results.findings.advice import Effort
from harness.study.placement import effort, question, question_clips, question_run
from harness.study.placement.effort import Budget
from harness.study.placement.placement_study import run_placement
from tests.command import Command

ONE_STATION = "tests.study.placement.one_station:OneStation"
BENT = "tests.study.placement.one_station:Bent"
NO_STATION = "tests.study.placement.one_station:NoStation"
Small = Callable[..., None]


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Small:
    """Questions on a few performers and clips of 1.5 s, in an empty folder; further calls change the budgets."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(question, "CLIP_S", 1.5)
    monkeypatch.setattr(question_clips, "POOL_PERFORMERS", question_clips.POOL_PERFORMERS[:8])
    monkeypatch.setattr(question_clips, "HELD_OUT_PERFORMERS", question_clips.HELD_OUT_PERFORMERS[:7])

    def limit(**cells: int) -> None:
        budgets: dict[Effort, Budget] = {**effort.EFFORTS}
        budgets |= {name: Budget(most, budgets[name].minutes) for name, most in cells.items()}  # type: ignore[index, misc]
        monkeypatch.setattr(question, "EFFORTS", budgets)

    return limit


def cell_names(out: Path) -> set[str]:
    return {folder.name for folder in (out / "cells").iterdir()}


@pytest.mark.long
def test_a_question_is_answered_alike_on_the_terminal_the_page_and_in_json(small: Small, command: Command) -> None:
    words = ["placement", "--stations", "1-2", "--behaviour", "boxing", "--places", "hand,pelvis", "--clips", "7"]
    words += ["--method", ONE_STATION, "--second-method", "none", "--noise", "clean", "--jobs", "1"]
    ended = command(*words)
    out = Path("results/placement_boxing_1-2")
    findings = read_placement(out / "findings.json")
    shown, beside, _ = ended.out.splitlines()[-3:]
    tied = "left hand, or one of 2 places of 3 that cannot be told from it"  # the method moves no joint
    assert shown.startswith(f"Wear one station for boxing: {tied} (chosen on 7 performers). It errs ")
    assert shown.endswith(" on 7 held-out known performers.")
    assert beside.startswith("Two stations are not better: ")
    assert f"<h1>{shown.partition(' It errs')[0]}</h1>" in (out / "report.html").read_text(encoding="utf-8")
    assert ended.err.splitlines()[0] == (
        "A search on 7 clips of 6 sets: at most 42 cells to choose on and about 14 on held-out clips."
    )
    assert ended.err.splitlines()[-1] == f"next: harness plot {out}"
    assert (findings.sizes, findings.effort, findings.split) == ((1, 2), "", "known")
    assert (findings.noise, findings.best[0].of, findings.best[0].held_out_clips) == ("clean", 3, 7)
    assert findings.advice is not None
    assert (findings.advice.best.stations, findings.advice.why) == (("left_hand",), "smallest")
    assert len(cell_names(out)) == 6 * 7 + 2 * 7
    before = cell_names(out)
    said = command(*words, "--json").content
    assert (said["answer"], said["other_sizes"], said["outcome"]) == (shown, [beside], "pass")
    assert cell_names(out) == before


@pytest.mark.long
def test_efforts_rounds_and_runs_share_their_cells(small: Small, tmp_path: Path) -> None:
    """Ten pairs: quick 10 on 1, 5 on 2, 4 on 4 and 8 performers; thorough all on 8, and never a cell twice."""
    small(quick=44, thorough=80)
    asked = question.PlacementQuestion(2, 2, ("boxing",), ("hand", "pelvis", "head", "torso"), ONE_STATION, "clean")
    quick = replace(asked, effort="quick", second_method="none")
    findings, outcome = run_placement(quick, tmp_path / "out")
    assert outcome is Outcome.PASS
    sets = [(one.sets, one.units, one.kept) for one in findings.rounds]
    assert sets[0] == (10, 1, 5)
    used = sum(
        now * (units - before)
        for (now, units, _), before in zip(sets, [0, *(units for _, units, _ in sets)], strict=False)
    )
    assert used <= 44
    assert len(cell_names(tmp_path / "out")) == used + 7
    first = cell_names(tmp_path / "out")
    thorough, _ = run_placement(replace(quick, effort="thorough"), tmp_path / "out")
    assert [(one.sets, one.units) for one in thorough.rounds] == [(10, 8)]
    assert first < cell_names(tmp_path / "out")
    held_out = {findings.best[0].stations, thorough.best[0].stations}
    assert len(cell_names(tmp_path / "out")) == 10 * 8 + 7 * len(held_out)
    again, _ = run_placement(quick, tmp_path / "out")
    assert (again.rounds, again.advice, again.size_steps) == (findings.rounds, findings.advice, findings.size_steps)


@pytest.mark.slow
def test_questions_of_other_places_share_the_cells_of_equal_sets(small: Small, tmp_path: Path) -> None:
    """Three pairs of three places on eight performers; then the ten of five places and, all among these, two pairs
    that are worn on both sides. Of each question the best set is tested on seven others."""
    small(quick=80)
    asked = question.PlacementQuestion(2, 2, ("boxing",), ("hand", "pelvis"), ONE_STATION, "clean", effort="quick")
    asked, tested = replace(asked, second_method="none"), set[tuple[str, ...]]()
    for changes, sets in (
        ({}, 3),
        ({"places": ("hand", "pelvis", "head", "torso")}, 10),
        ({"places": ("hand", "head", "pelvis", "torso"), "symmetric": True}, 10),
    ):
        findings, outcome = run_placement(replace(asked, **changes), tmp_path / "out")
        assert outcome is Outcome.PASS
        assert findings.rounds[-1].units == 8
        tested.add(findings.best[0].stations)
        assert len(cell_names(tmp_path / "out")) == sets * 8 + 7 * len(tested)


@pytest.mark.slow
def test_a_second_method_that_disagrees_is_the_headline(small: Small, command: Command) -> None:
    """The first method reads nothing, so that it takes the cheaper place; the second one needs the pelvis."""
    words = ["placement", "--stations", "1", "--behaviour", "golf", "--places", "head,pelvis", "--noise", "clean"]
    words += ["--cost", "pelvis=2", "--baud", "57600", "--split", "subject", "--jobs", "1", "--effort", "quick"]
    ended = command(*words, "--method", NO_STATION, "--second-method", BENT, "--json")
    findings = read_placement(Path("results/placement_golf_1/findings.json"))
    assert findings.second is not None
    assert findings.advice is not None
    (choice,) = findings.second.choices
    assert (choice.chosen, choice.best, choice.worse) == (("head",), ("pelvis",), True)
    assert choice.shared is not None
    assert (choice.shared.stations, choice.shared.cost, choice.shared.units) == (("pelvis",), 2.0, 7)
    assert findings.advice.best.stations == ("head",)
    assert (choice.of, choice.units) == (2, 8)
    assert findings.station_costs == {"head": 1.0, "pelvis": 2.0}
    assert [point.cost for point in findings.front] == [1.0]
    assert findings.split == "new"
    assert "new performers" in ended.content["answer"]
    assert ended.content["answer"].startswith("Wear one station for golf: pelvis, good under both methods (a quick ")
    content = Path("results/placement_golf_1/report.html").read_text(encoding="utf-8")
    assert re.search(r"<h1>Wear [^<]*pelvis, good under both methods", content)
    assert "The body with the recommended stations pelvis" in content


@pytest.mark.slow
def test_without_the_cells_for_every_set_stations_are_added_one_after_another(small: Small, command: Command) -> None:
    small(quick=20)
    words = ["placement", "--stations", "3", "--behaviour", "golf", "--places", "head,torso,hand,ankle,pelvis"]
    words += ["--with", "pelvis", "--method", ONE_STATION, "--second-method", "none", "--noise", "clean"]
    command(*words, "--jobs", "1", "--minutes", "1")
    findings = read_placement(Path("results/placement_golf_3/findings.json"))
    assert [(one.size, one.base) for one in findings.rounds[:1]] == [(1, ("pelvis",))]
    assert {one.size for one in findings.rounds} == {1, 2, 3}
    assert findings.effort == "quick"
    assert all("pelvis" in tried.stations for tried in findings.tried)
    assert "one after another" in findings.notes[1]


@pytest.mark.slow
def test_a_late_search_says_so_with_the_cells_of_everything_that_it_does(
    small: Small, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three places on eight performers, the best one on seven others, and all three again with the second method."""
    clock = iter([0.0, *[600.0] * 10_000])
    monkeypatch.setattr(question_run, "monotonic", lambda: next(clock))
    asked = question.PlacementQuestion(1, 1, ("boxing",), ("hand", "pelvis"), ONE_STATION, "clean", effort="quick")
    told: list[str] = []
    findings, outcome = run_placement(
        replace(asked, second_method=NO_STATION), tmp_path / "out", announce=lambda news: told.append(str(news))
    )
    assert outcome is Outcome.PASS
    assert told[0] == (
        "A quick search of 3 sets: at most 24 cells to choose on, about 7 on held-out clips and 24 with "
        f"{NO_STATION}; about 1 min on two quiet cores."
    )
    assert told[1].startswith("The search goes on after 10 min: ")
    assert f"About {10 * (24 + 7 + 24 - 1)} min more; " in told[1]  # the first cell took all of them
    assert findings.advice is not None
    assert len(cell_names(tmp_path / "out")) == findings.planned == 24 + 7 + 24


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--effort", "quick", "--clips", "7"], "--effort with --clips"),
        (["--effort", "quick", "--minutes", "7"], "--effort with --minutes"),
        (["--minutes", "2", "--clips", "7"], "--minutes with --clips"),
        (["--with", "head,"], "The list 'head,' has an empty name"),
        (["--with", "nose"], "no place called 'nose'"),
        (["--with", "head,hand,pelvis", "--stations", "3"], "3 stations cannot contain the 4 of --with"),
        (["--cost", "nose=1"], "no place called 'nose'"),
        (["--cost", "head=0"], "'0' is not a positive number"),
        (["--cost", "head=-2"], "'-2' is not a positive number"),
        (["--cost", "head"], "'' is not a positive number"),
        (["--cost", "head=1,head=2"], "no list of costs"),
        (["--cost", "shin=2"], "right_shin is no place of this question"),
        (["--symmetric", "--places", "left_hand,head,pelvis"], "--symmetric with left_hand alone"),
        (["--baud", "300"], "300 baud carries 3 stations at 0.26 Hz"),
        (["--minutes", "0"], "'0' is not a positive number"),
        (["--second-method", "expert_map"], "is the first one too"),
        (["--second-method", "ridg"], "ridg"),
        (["walking", "--with", "head"], "--with with the study walking"),
    ],
)
def test_what_is_refused_says_why_before_anything_is_written(
    words: list[str], said: str, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = command("placement", *words, code=2)
    assert said in ended.err
    assert not list(tmp_path.iterdir())
