"""`harness timeline` as a user meets it: order, changes, comparisons beside the page, breaks, refusals."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.results import ResultSet
from tests.command import Command
from tests.compare.sides import manifest, side, write_run
from tests.compare.test_comparison import ANGLE
from tests.report.reading import read, text_of

CLIPS = 12
METRICS = f"{ANGLE},step_relative"


def entry(number: int, processor: str = "Xeon", **fields: Any) -> ResultSet:
    """`ik` is worse by 3 % from the sixth entry on, `ridge` never changes; the slower machine takes twice as long."""
    noise = [1.0 + 0.002 * ((7 * number + 3 * clip) % 5 - 2) for clip in range(CLIPS)]
    methods: dict[str, Any] = {"ik": [n * (1.03 if number >= 6 else 1.0) for n in noise], "ridge": 2.0}
    slow = 2.0 if processor == "Xeon" else 4.0
    made = side(f"r{number}", methods, CLIPS, metrics={"step_relative": slow}, **fields)
    by = manifest(commit=f"{number:04}", processor=processor)
    date, commit_date = f"2026-10-{20 - number:02}T08:00:00+00:00", f"2026-10-{number:02}T08:00:00+02:00"
    return replace(made, manifest=replace(by, date=date, commit_date=commit_date))


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten results whose names are in another order than their commits; the last two are of another rate."""
    folder = tmp_path_factory.mktemp("entries")
    for number in range(1, 11):
        other = {"defined_by": {"tracker": {"rate_hz": 60.0, "items": [40, 2]}}} if number > 8 else {}
        made = entry(number, "Xeon" if number < 8 else "Opteron", **other)
        write_run(folder / "all" / f"r{'cafbedhgij'[number - 1]}", made)
    return folder


@pytest.fixture
def here(runs: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(runs)
    return runs


def test_the_step_is_named_with_its_entry_and_its_comparison(here: Path, command: Command) -> None:
    lines = command("timeline", "all", "--metrics", METRICS, "--html", "pages/t.html").lines
    assert lines[0].startswith("1 change in 8 series over 10 entries: ik worse at rd (joint_angle_mean_deg +3.")
    said = "\n".join(lines)
    assert "entries: 10, in the order of the dates of their commits" in said
    assert "new series begin at: ri: tracker.rate_hz: 40 against 60" in said
    assert "machines: 2; times are compared on one only" in said
    (row,) = [line for line in lines if "harness compare" in line]
    assert "✗ worse" in row
    assert row.endswith("harness compare all/re all/rd")
    links = [str(a["href"]) for tag, a in read(here / "pages" / "t.html").found if tag == "a" and "href" in a]
    (link,) = [link for link in links if link.endswith(".html")]
    assert "ik joint_angle_mean_deg" in text_of(here / "pages" / link)
    shown = text_of(here / "pages" / "t.html")
    assert "1 change in 8 series" in shown
    assert "harness compare all/re all/rd" in shown


def test_json_has_every_series(here: Path, command: Command) -> None:
    said = command("timeline", "all", "--metrics", METRICS, "--json").content
    assert (said["outcome"], said["order"], said["page"]) == ("pass", "commit", "timeline.html")
    assert [each["name"] for each in said["entries"]] == [f"r{letter}" for letter in "cafbedhgij"]
    (changed,) = [each for each in said["series"] if each["changes"]]
    assert (changed["method"], changed["metric"], changed["units"]) == ("ik", ANGLE, CLIPS)
    assert changed["entries"] == list(range(8))
    assert changed["changes"][0]["at"] == 5
    times = [each["entries"] for each in said["series"] if (each["method"], each["metric"]) == ("ik", "step_relative")]
    assert times == [list(range(7)), [8, 9]]


def test_order_and_labels(here: Path, command: Command) -> None:
    words = ("timeline", "new=all/ra", "old=all/rc", "--metrics", ANGLE, "--json")
    for order, names in (("commit", ["old", "new"]), ("date", ["new", "old"]), ("given", ["new", "old"])):
        said = command(*words, "--order", order).content
        assert (said["order"], [each["name"] for each in said["entries"]]) == (order, names)
    command("baseline", "save", "kept", "all/rb")
    assert len(command("timeline", "results/baselines", "all/ra", "--json").content["entries"]) == 2
    apart = command("timeline", "all/ra", "all/ri", code=3).lines
    assert apart[0] == "No two entries can be compared."


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("all/ra", "1 result"),
        ("nothing", "nothing: no results of the harness; expected a run, a sweep or a baseline"),
        ("all --methods rigde", "Did you mean 'ridge'"),
        ("all --metrics mpjpe_m", "Did you mean 'mpjpe_mm'"),
        ("all --order comit", "Did you mean 'commit'"),
        ("all/ra all/ra", "is named 2 times"),
        ("undated all/ra --order date", "undated have no such date"),
    ],
)
def test_what_is_refused_says_why(words: str, said: str, here: Path, command: Command) -> None:
    if not (here / "nothing").exists():
        (here / "nothing").mkdir()
        write_run(here / "undated", side())
    assert said in command("timeline", *words.split(), code=2).err
