"""Numbers that the command line accepts."""

import argparse

import pytest

from harness.commands.flags import MOST_PROCESSES, process_count


@pytest.mark.parametrize(
    "text", ["0", "-1", "1.0", "1e2", "two", "", " 1", "\u00b2", "\u0663", str(MOST_PROCESSES + 1), "9" * 4301]
)
def test_numbers_of_processes_that_are_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=r"positive whole number|at most 1,024 are started"):
        process_count(text)


def test_numbers_of_processes_that_are_accepted() -> None:
    assert [process_count(text) for text in ("1", "007", str(MOST_PROCESSES))] == [1, 7, MOST_PROCESSES]
