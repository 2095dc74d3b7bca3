"""Names that no folder can have, or that break a line, are refused in one line of bounded length."""

from pathlib import Path

import pytest

from harness.cli import main
from harness.compare.baseline import write_baseline
from harness.core.names import Label, check_words
from harness.errors import BadInput, HarnessError
from harness.experiment.scenario import load_scenario
from harness.experiment.sweep_config import load_sweep

LONGEST_LINE = 1100
BAD = {"empty": "", "long": "x" * 1001, "null": "a\\u0000b", "newline": "a\\nb", "bell": "a\\u0007b"}
"""Values in TOML's escapes."""
NO_FILE = BAD | {"parent": "..", "path": "../other", "backslash": "a\\\\b"}
SCENARIO = """
name = "{name}"
methods = ["{method}"]
[motion]
source = "builtin"
behaviours = ["{behaviour}"]
test = ["{test}"]
[stations]
"{station}" = {{ bone = "head" }}
[vary]
"{vary}" = ["clean"]
"""
GOOD = {
    "name": "mine",
    "method": "ik",
    "behaviour": "walking",
    "test": "walking_p1_01",
    "station": "head",
    "vary": "noise",
}


def one_line(text: str) -> bool:
    return text.isprintable() and 0 < len(text) < LONGEST_LINE


def test_good_names_are_read(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.format(**GOOD))
    assert load_scenario(path).name == "mine"


@pytest.mark.parametrize("bad", NO_FILE)
@pytest.mark.parametrize("key", GOOD)
def test_a_bad_name_in_a_scenario_is_refused(tmp_path: Path, key: str, bad: str) -> None:
    if bad not in BAD and key != "name":
        return  # only folders get names that must be no path
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.format(**{**GOOD, key: NO_FILE[bad]}))
    with pytest.raises(HarnessError) as caught:
        load_scenario(path)
    assert one_line(str(caught.value).replace(str(tmp_path), ""))


@pytest.mark.parametrize("bad", NO_FILE)
def test_a_bad_name_of_a_sweep_is_refused(tmp_path: Path, bad: str) -> None:
    path = tmp_path / "sweep.toml"
    path.write_text(f'name = "{NO_FILE[bad]}"\nscenarios = ["demo"]\n')
    with pytest.raises(HarnessError) as caught:
        load_sweep(path)
    assert one_line(str(caught.value).replace(str(tmp_path), ""))


@pytest.mark.parametrize("name", ["", "x" * 300, "a\0b", "a\nb", "..", "../x"])
def test_a_bad_name_of_a_baseline_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput) as caught:
        write_baseline(tmp_path, name, tmp_path)
    assert one_line(str(caught.value))


@pytest.mark.parametrize("word", ["", "x" * 300, "a\0b", "a\nb", "x" * 300 + "/run"])
@pytest.mark.parametrize(
    "command",
    [
        ["run", "demo", "--out", "WORD"],
        ["run", "WORD"],
        ["run", "demo", "--methods", "WORD", "--out", "out"],
        ["sweep", "WORD"],
        ["placement", "WORD"],
        ["baseline", "save", "WORD", "run"],
        ["baseline", "save", "main", "WORD"],
        ["compare", "WORD", "run"],
        ["report", "WORD"],
        ["status", "WORD"],
        ["check", "WORD"],
        ["inspect", "WORD"],
    ],
    ids=" ".join,
)
def test_a_bad_word_of_the_command_line_is_refused(
    command: list[str], word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([word if part == "WORD" else part for part in command]) == 2
    shown = capsys.readouterr()
    assert shown.out == "refused\n"
    assert one_line(shown.err.removesuffix("\n"))
    assert not list(tmp_path.iterdir())


def test_ordinary_words_are_accepted() -> None:
    check_words(["13_17", Path("../results") / ("x" * 255), None, 5, ("ä ö", Path("/a/b"))])
    assert Label(of_file=True).accepts("builtin walking 2.5")
    assert not Label().accepts(" head")
