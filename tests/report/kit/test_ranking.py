"""The chart of a ranking: which methods lie beyond its axis, and where long names break."""

import numpy as np
import pytest

from harness.compare import MethodRanking
from harness.report.kit.ranking import RankingPanel, explain_marks, wrap_name


@pytest.mark.parametrize(
    ("means", "inside"),
    [
        ([1.0, 1.1, 1.2, 7.9], 3),
        ([1.0, 1.1, 1.2, 2.1], 4),
        ([1.0, 1.1, 8.0, 9.0], 2),
        ([1.0, 8.0], 2),
        ([1.0, 8.0, 9.0], 3),
        ([1.0, 1.1, 2.9, 3.5, 100.0, 200.0], 4),
        ([2.0], 1),
        ([0.0, 0.0, 1.0], 2),
    ],
)
def test_a_method_that_errs_several_times_as_much_does_not_squeeze_the_others(means: list[float], inside: int) -> None:
    values = {f"m{n}": np.full(8, mean) for n, mean in enumerate(means)}
    panel = RankingPanel(
        "", MethodRanking("joint_angle_mean_deg", tuple("abcdefgh"), tuple("abcdefgh"), values, {}, {}, {})
    )
    assert panel.largest_drawn == means[inside - 1]
    assert ("beyond the axis" in explain_marks([panel])) == (inside < len(means))


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("ik", 1),
        ("dynamic_map:literal", 1),
        ("dynamic_map[widening=200,gate.reach_m=0.5]+ik", 3),
        ("x" * 100, 3),
    ],
)
def test_names_are_broken_where_they_have_parts(name: str, lines: int) -> None:
    wrapped = wrap_name(name, 24)
    assert wrapped.count("\n") == lines - 1
    assert max(map(len, wrapped.splitlines())) <= 25
    if len(name) < 60:
        assert wrapped.replace("\n", "") == name
