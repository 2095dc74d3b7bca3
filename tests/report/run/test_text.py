"""The tables of a run on a terminal."""

from typing import Any

import pytest

from harness.report.run.text import MOST_ROWS, run_table
from harness.results import PRIMARY_METRIC, read_summary
from tests.planted import Plan, planted_run


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Fourteen methods on two behaviours; the first is best."""
    methods = {f"m{n:02d}": 1.0 + 0.5 * n for n in range(14)}
    out = planted_run(tmp_path_factory.mktemp("text") / "run", Plan(methods=methods, takes=1, duration_s=2.0))
    return read_summary(out)


def test_a_short_table_has_the_twelve_methods_with_the_lowest_errors(summary: Any) -> None:
    text = run_table(summary, short=True)
    table = text.split("\n\n")[1].splitlines()
    assert table[0].split()[0] == "method"
    assert len(table) == 1 + MOST_ROWS + 1
    errors = {row["method"]: row["metrics"][PRIMARY_METRIC]["mean"] for row in summary["methods"]}
    assert [line.split()[0] for line in table[1:-1]] == sorted(errors, key=lambda name: errors[name])[:MOST_ROWS]
    assert table[-1] == "2 more rows, and the rows of single behaviours: --all, or the report."
    assert max(map(len, table)) <= 100


def test_the_whole_table_has_a_row_for_each_method_and_behaviour(summary: Any) -> None:
    behaviours = {row["behaviour"] for row in summary["behaviours"]}
    assert len(behaviours) > 1
    table = run_table(summary).split("\n\n")[1].splitlines()
    assert len(table) == 1 + 14 * len(behaviours)


def test_few_rows_are_all_shown(summary: Any) -> None:
    few = {**summary}
    for name in ("methods", "behaviours", "cells"):
        few[name] = [row for row in summary[name] if row["method"] < "m03"]
    assert run_table(few, short=True) == run_table(few)


def test_the_ranking_is_one_sentence_where_nothing_can_be_told(summary: Any) -> None:
    (line,) = [line for line in run_table(summary, short=True).splitlines() if "lowest mean" in line]
    assert line.startswith("m00 has the lowest mean joint-angle error, ")
    assert line.endswith(", but cannot be called better than any of the other 13 (too few units: 1, of at least 6).")
