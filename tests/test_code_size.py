"""The counter of code lines, by an example, and the budget that holds the lines of each folder."""

import re

import pytest

from tests.code_size import budget_line, budgeted_sizes, code_lines, read_budget
from tests.test_prose import ROOT


def test_only_code_counts() -> None:
    source = '"""Module."""\n\nX = 1  # one\n"""Attribute\nof two lines."""\n\n\n'
    source += 'def f(\n    a,\n):\n    """Doc."""\n    return """a\n\n# b"""\n'
    assert code_lines(source) == 7


@pytest.mark.long
def test_no_folder_grows_beyond_its_budget() -> None:
    budget = read_budget()
    over = {name: lines for name, lines in budgeted_sizes(ROOT).items() if lines > budget.get(name, 0)}
    assert not over, (
        f"more code lines than tests/code_budget.toml allows: {over}. Remove something first. For good reasons "
        "`python -m tests.code_size --write` raises the table and prints the line for docs/CHANGELOG.md."
    )


def test_the_changelog_says_what_a_budget_is_for_and_what_went() -> None:
    """A table that was raised alone has another sum than the newest line of the changelog."""
    changelog = " ".join((ROOT / "docs" / "CHANGELOG.md").read_text(encoding="utf-8").split())
    newest = re.search(r"- Code lines: at most .*?(?= - |$)", changelog)
    assert newest, "docs/CHANGELOG.md has no line on the budget of code lines"
    assert newest[0].startswith(budget_line(read_budget())), f"the newest line is {newest[0]!r}"
    assert re.search(r"Grown for: (?!WHAT)\S+.*\. Gone: (?!WHAT)\S+", newest[0])
