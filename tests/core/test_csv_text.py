"""No name becomes a formula, numbers stay numbers, and every text reads back as it was."""

import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.core.csv_text import csv_line, escape_formula, unescape_formula


@pytest.mark.parametrize(
    "name", ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", "\t=1", "\r=1", "＝1", "-inf", "--x"]
)
def test_a_formula_is_written_as_text(name: str) -> None:
    assert escape_formula(name) == f"'{name}"


@pytest.mark.parametrize("text", ["-1.5", "+3", "-.5", "-1e-05", "7", "", "nan", "a=b", "a-b", "'quoted'", "o'neil"])
def test_numbers_and_other_names_stay_as_they_are(text: str) -> None:
    assert escape_formula(text) == text


@given(st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\0")) | st.from_regex("'*[=@+-].*")))
def test_every_text_reads_back(fields: list[str]) -> None:
    (read,) = csv.reader(io.StringIO(csv_line([*fields, "end"]), newline=""))
    assert [*map(unescape_formula, read)] == [*fields, "end"]


def test_numbers_and_gaps_are_fields() -> None:
    assert csv_line([-1, -0.25, None, 'say "a,b"', "=x"]) == '-1,-0.25,,"say ""a,b""",\'=x\n'
