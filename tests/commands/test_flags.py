"""Numbers that the command line accepts, and flags that verbs had once, which are refused with advice."""

import argparse
import shlex

import pytest

from harness.commands.flags import MOST_PROCESSES, REMOVED_FLAGS, process_count
from tests.command import Command


@pytest.mark.parametrize(
    "text", ["0", "-1", "1.0", "1e2", "two", "", " 1", "\u00b2", "\u0663", str(MOST_PROCESSES + 1), "9" * 4301]
)
def test_numbers_of_processes_that_are_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=r"positive whole number|at most 1,024 are started"):
        process_count(text)


def test_numbers_of_processes_that_are_accepted() -> None:
    assert [process_count(text) for text in ("1", "007", str(MOST_PROCESSES))] == [1, 7, MOST_PROCESSES]


@pytest.mark.parametrize(("verb", "flag"), [(verb, flag) for verb, flags in REMOVED_FLAGS.items() for flag in flags])
@pytest.mark.parametrize("value", ["", " 3", "=3"])
def test_a_removed_flag_is_refused_with_advice(verb: str, flag: str, value: str, command: Command) -> None:
    (line,) = command(*shlex.split(f"{verb} {flag}{value}"), code=2).err.splitlines()
    assert line == f"harness: `harness {verb}` no longer has {flag}. {REMOVED_FLAGS[verb][flag]}."


def test_no_help_shows_a_removed_flag(command: Command) -> None:
    for verb, flags in REMOVED_FLAGS.items():
        said = command(verb, "--help").out
        assert "usage: harness" in said
        assert [flag for flag in flags if f"{flag} " in said] == []
