"""Messages are one printable line of bounded length, and name the file."""

import pickle
from pathlib import Path

import pytest

from harness.errors import (
    MAX_TEXT,
    BadFile,
    BadInput,
    HarnessError,
    NothingMeasured,
    Outcome,
    UnknownName,
    name_file,
    shorten,
)
from harness.experiment.scenarios import load_scenario


@pytest.mark.parametrize("text", ["two\nlines", "a\0b", "x" * 100_000, "\ud800" * 1000, "\x1b[31mred"])
def test_any_text_becomes_a_short_line(text: str) -> None:
    line = shorten(text)
    assert line.isprintable()
    assert 0 < len(line) <= MAX_TEXT
    errors = (
        BadFile(text, text, text, text, 3),
        BadInput(text, text),
        UnknownName(text, text, [text] * 100),
        NothingMeasured(text, 2),
    )
    for error in errors:
        assert str(error).isprintable()
        assert len(str(error)) < 2000


def test_the_end_of_a_long_text_stays_because_it_names_the_place() -> None:
    assert shorten("a" * 1000 + " (at line 3)").endswith("a (at line 3)")
    assert shorten("as it is") == "as it is"


def test_a_wrong_name_in_a_scenario_names_its_file(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text("nmae = 1")
    with pytest.raises(UnknownName) as refused:
        load_scenario(tmp_path / "x.toml")
    assert str(refused.value).startswith(f"{tmp_path / 'x.toml'}: no key in scenario called 'nmae'.")


def test_the_innermost_file_is_named_also_after_pickling() -> None:
    with pytest.raises(HarnessError) as refused, name_file(Path("outer")), name_file(Path("inner")):
        raise BadInput("a = 1.", "Use 2.")
    assert str(pickle.loads(pickle.dumps(refused.value))) == "inner: a = 1. Use 2."  # noqa: S301  # our own bytes


def test_the_outcome_of_nothing_measured_survives_pickling() -> None:
    for failed, outcome in ((0, Outcome.NOT_COMPARABLE), (3, Outcome.INCOMPLETE)):
        error = pickle.loads(pickle.dumps(NothingMeasured("run", failed)))  # noqa: S301  # our own bytes
        assert (error.outcome, "(3 failed)" in str(error)) == (outcome, failed > 0)
