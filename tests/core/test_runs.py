"""Runs of True against a plain loop."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from harness.core.runs import find_runs


@given(st.lists(st.booleans(), max_size=40))
def test_runs_are_those_of_a_plain_loop(condition: list[bool]) -> None:
    expected: list[list[int]] = []
    for n, holds in enumerate(condition):
        if holds and expected and expected[-1][1] == n:
            expected[-1][1] += 1
        elif holds:
            expected.append([n, n + 1])
    found = find_runs(np.array(condition, dtype=bool))
    assert found.shape == (len(expected), 2)
    assert found.tolist() == expected
