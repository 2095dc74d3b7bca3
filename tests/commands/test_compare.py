"""`harness compare` and `harness baseline` as a user meets them: every exit code, JSON, the page, advice."""

from pathlib import Path

import pytest

from harness.compare import holm
from harness.results import ResultSet
from tests.command import Command
from tests.compare.sides import manifest, side, write_run
from tests.compare.test_comparison import ANGLE, STEADY, TORN
from tests.report.reading import text_of

SIDES = {
    "main": side(),
    "again": side(),
    "worse": side(methods={"ik": STEADY}),
    "torn": side(methods={"ik": TORN}),
    "few": side(clips=5),
    "faster_few": side(methods={"ik": 0.5}, clips=5),
    "other": side(scenario="other"),
    "faster": side(defined_by={"tracker": {"rate_hz": 60.0, "items": [40, 2]}}),
    "part": side(metrics={"frames_matched": 150}),
    "holes": side(failed=["ik on walk_99"]),
    "empty": ResultSet("empty", manifest(), (), 0),
    "three": side(methods={"mean_pose": STEADY, "ik": 1.0, "far": 3.0}),
    "two": side(methods={"ik": 1.0, "mean_pose": STEADY}),
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sides")
    for name, judged in SIDES.items():
        write_run(folder / name, judged)
    return folder


@pytest.fixture
def here(runs: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The place of work, with a run for each of the sides."""
    monkeypatch.chdir(runs)
    return runs


@pytest.mark.parametrize(
    ("words", "code", "word", "said"),
    [
        ("main again", 0, "pass", "B is no worse than A"),
        ("main worse", 1, "regressed", "B is worse than A"),
        ("worse main", 0, "pass", "better"),
        ("main torn", 3, "not comparable", "the interval contains zero"),
        ("few few", 0, "pass", "no worse"),
        ("few faster_few", 3, "not comparable", "too few units: 5, of at least 6"),
        ("main other", 3, "not comparable", "scenario: demo against other"),
        ("main empty", 3, "not comparable", "no cell of A has a partner in B"),
        ("main faster", 3, "not comparable", "tracker.rate_hz: 40 against 60"),
        ("main faster --allow tracker.rate_hz", 0, "pass", "tracker.rate_hz: 40 against 60"),
        ("main faster --allow", 0, "pass", "tracker.rate_hz"),
        ("main other --allow scenario", 0, "pass", "no worse"),
        ("main part", 3, "not comparable", "1200 of 1600 frames in B"),
        ("main part --allow coverage", 0, "pass", "no worse"),
        ("main few", 3, "not comparable", "3 cells are only in A"),
        ("main holes", 4, "incomplete", "ik on walk_99"),
        ("two --methods ik,mean_pose", 1, "regressed", "ik vs mean_pose"),
        ("two --methods mean_pose,ik", 0, "pass", "mean_pose vs ik"),
        ("main two --methods ik", 0, "pass", "no worse"),
    ],
)
def test_exit_codes_and_words(words: str, code: int, word: str, said: str, here: Path, command: Command) -> None:
    lines = command("compare", "--metrics", ANGLE, *words.split(), code=code).lines
    assert lines[-1] == word
    assert said in "\n".join(lines)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("main", "main alone. Name another result, or two of its methods with --methods a,b."),
        ("main --methods ik", "main alone."),
        ("main --methods ik,ik", "main alone."),
        ("main nowhere", "no folder or baseline called 'nowhere'"),
        ("main no/where", "no such folder"),
        ("main again --metrics joint_angel_mean_deg", "Did you mean 'joint_angle_mean_deg'"),
        ("main again --methods ki", "no method in main called 'ki'"),
        ("main again --methods a,b,c", "names 3 methods"),
        ("main again torn --methods ik,ik", "Name one, or one for each of the 3 results."),
        ("main again main", "main is named 2 times"),
        ("main again torn --reference tron", "Did you mean 'torn'"),
        ("main faster --allow traker", "Did you mean 'tracker'"),
    ],
)
def test_what_is_refused_says_why(words: str, said: str, here: Path, command: Command) -> None:
    ended = command("compare", *words.split(), code=2)
    assert ended.out.splitlines() == ["refused"]
    assert said in ended.err
    assert len(ended.err.splitlines()) == 1


def test_an_interrupt_says_so(here: Path, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*given: object, **named: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("harness.compare.sides.compare_with_reference", interrupted)
    assert command("compare", "main", "again", code=130).lines == ["interrupted"]


def test_a_baseline_is_saved_and_compared_by_its_name(here: Path, command: Command) -> None:
    assert command("baseline", "save", "yesterday", "main").lines == ["baseline: results/baselines/yesterday", "pass"]
    command("compare", "yesterday", "again", "--metrics", ANGLE)
    command("compare", "yesterday", "worse", "--metrics", ANGLE, code=1)
    assert "--force" in command("baseline", "save", "yesterday", "worse", code=2).err
    assert command("baseline", "save", "yesterday", "worse", "--force", "--json").content == {
        "baseline": "results/baselines/yesterday",
        "next": "harness compare yesterday worse",
        "outcome": "pass",
    }
    command("compare", "yesterday", "worse", "--metrics", ANGLE)
    command("baseline", "save", "../yesterday", "main", code=2)
    command("baseline", "save", "holes", "holes", code=2)
    assert [path.name for path in (here / "results" / "baselines").iterdir()] == ["yesterday"]


def test_json_has_every_line(here: Path, command: Command) -> None:
    said = command("compare", "main", "worse", "--metrics", ANGLE, "--json", code=1).content
    assert said["outcome"] == "regressed"
    (line,) = [line for line in said["differences"] if line["gated"]]
    assert (line["verdict"], line["metric"], len(line["clips"])) == ("worse", ANGLE, 8)


def test_two_methods_of_one_result_are_the_names_of_the_sides(here: Path, command: Command) -> None:
    said = command("compare", "two", "--methods", "ik,mean_pose", "--metrics", ANGLE, code=1).lines
    assert {"A: ik of two", "B: mean_pose of two"} <= set(said)
    labelled = command("compare", "old=main", "new=worse", "--metrics", ANGLE, code=1).lines
    assert {"A: old", "B: new"} <= set(labelled)
    turned = command("compare", "old=main", "new=worse", "--metrics", ANGLE, "--reference", "new").lines
    assert {"A: new", "B: old", "pass"} <= set(turned)


MANY = ("compare", "main", "again", "./worse", "torn", "fast=faster", "--metrics", f"{ANGLE},mpjpe_mm")


def test_many_results_have_a_column_each(here: Path, command: Command) -> None:
    lines = command(*MANY, code=1).lines
    assert lines[0].startswith(f"1 of 4 results is worse than main: worse in 2 of 2 gated lines, most in {ANGLE} (+13")
    head = next(line for line in lines if line.startswith("line "))
    assert head.split() == ["line", "main", "again", "worse", "torn", "fast"]
    row = next(line for line in lines if line.startswith(f"ik ({ANGLE}"))
    assert [row.split().count(mark) for mark in "=✗?"] == [1, 1, 1]
    assert "- fast: inputs that differ: tracker.rate_hz: 40 against 60" in lines
    best = command(*MANY, "--allow", "tracker", "--reference", "worse", code=3).lines
    assert best[0].startswith("It cannot be decided whether a result is worse than worse. main: 2 of 2 gated lines are")
    assert "and among 8 lines a difference needs" in " ".join(best[:2])


def test_holms_correction_covers_the_lines_of_all_results(here: Path, command: Command) -> None:
    said = command(*MANY, "--json", code=1).content
    assert (said["reference"], said["outcome"]) == ("main", "regressed")
    assert [(each["b"], each["outcome"]) for each in said["comparisons"]] == [
        *(("again", "pass"), ("worse", "regressed"), ("torn", "not comparable"), ("fast", "not comparable")),
    ]
    lines = [line for each in said["comparisons"] for line in each["differences"] if line["gated"]]
    differing = [line for line in lines if line["difference"]]
    assert len(differing) == 4
    assert [line["p_holm"] for line in differing] == holm([line["p"] for line in differing])
    (pair,) = [
        line
        for line in command("compare", "main", "worse", "--metrics", ANGLE, "--json", code=1).content["differences"]
        if line["gated"]
    ]
    (among,) = [line for line in differing if line["metric"] == ANGLE and line["verdict"] == "worse"]
    assert among == {**pair, "p_holm": 4 * pair["p"]}


def test_more_methods_than_two_of_one_result(here: Path, command: Command) -> None:
    words = ("compare", "three", "--methods", "mean_pose,ik,far", "--metrics", ANGLE)
    lines = command(*words, "--reference", "ik", code=1).lines
    most = f"in 1 of 1 gated lines, most in {ANGLE}"
    assert " ".join(lines[:2]) == f"2 of 2 results are worse than ik: mean_pose {most} (+13 %); far {most} (+200 %)."
    assert next(line for line in lines if line.startswith("line ")).split() == ["line", "ik", "mean_pose", "far"]


def test_the_page_of_many_results_shows_each(here: Path, command: Command) -> None:
    command(*MANY, "--html", "many.html", code=1)
    shown = text_of(here / "many.html")
    assert "1 of 4 results is worse than main" in shown
    assert all(name in shown for name in ("again", "worse", "torn", "fast", "tracker.rate_hz: 40 against 60"))
    assert shown.count("cannot tell") >= 2


def test_a_page_is_written(here: Path, command: Command) -> None:
    said = command("compare", "main", "worse", "--metrics", ANGLE, "--html", "pages/worse.html", code=1)
    assert "page: pages/worse.html" in said.out
    assert "B is worse than A" in (here / "pages" / "worse.html").read_text()
