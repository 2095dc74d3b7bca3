"""Complaints about the words of a command line: one line that names the verb and suggests the nearest name."""

import shlex

import pytest

from tests.command import Command

CASES = [
    ("--verson", "no flag of `harness` called '--verson'. Did you mean '--version'?"),
    ("demo --methdos ik", "no flag of `harness demo` called '--methdos'. Did you mean '--methods'?"),
    ("demo --methdos=ik", "no flag of `harness demo` called '--methdos'."),
    ("live --prot /dev/x", "no flag of `harness live` called '--prot'. Did you mean '--port'?"),
    ("demo x", "`harness demo` has no place for 'x'. See `harness demo --help`."),
    ("check ik -j 2", "no flag of `harness check` called '-j'."),
    ("run", "`harness run`: it needs scenario."),
    ("live", "`harness live`: it needs --port, --scenario."),
    ("baseline sav a b", "no action called 'sav'. Did you mean 'save'?"),
    ("paper kim", "no paper called 'kim'. Did you mean 'kim2012'?"),
    ("export a --format trk", "no choice of --format called 'trk'. Did you mean 'trc'?"),
    ("demo --seed x", "`harness demo`: --seed: not a whole number: 'x'."),
    ("view a --from x", "`harness view`: --from: not a number: 'x'."),
    ("run demo --methods ik,,ridge", "The list 'ik,,ridge' has an empty name."),
    ("plot a --methods ,", "The list ',' has an empty name."),
    ("record a b --alignment -1,0", "A value that begins with '-' follows '=', as in --flag=-1."),
]


@pytest.mark.parametrize(("words", "said"), CASES)
def test_a_wrong_word_is_one_line(words: str, said: str, command: Command) -> None:
    ended = command(*shlex.split(words), code=2)
    assert ended.out == "refused\n"
    (line,) = ended.err.splitlines()
    assert said in line
    assert command("--json", code=2).content["outcome"] == "refused"


def test_the_complaint_is_in_the_json(command: Command) -> None:
    content = command("run", "--json", code=2).content
    assert content == {"error": "`harness run`: it needs scenario. See `harness run --help`.", "outcome": "refused"}


def test_words_that_are_no_flags_are_left_alone(command: Command) -> None:
    """The beginning of a flag, a word after two dashes, and a text with spaces."""
    assert command("list", "inputs", "--js").content["outcome"] == "pass"
    assert "no kind of name called '--jsn'" in command("list", "--", "--jsn", code=2).err
    assert "no kind of name called '--a b'" in command("list", "--a b", code=2).err
