"""The bench of inverse kinematics: what it prints is real, whatever the speed of the machine."""

import pytest

pytest.importorskip("mink", reason="the bench compares with mink, an extra")

from harness.bench.ik import bench_ik


def test_converges_at_least_as_low_as_mink_and_three_times_as_fast() -> None:
    rows = {row.text: row for row in bench_ik(frames=200)}
    assert rows["ik, six trackers, converged"].verdict == ""
    assert rows["speed without prior and robust loss / mink"].verdict == "met"
    for name in ("cost", "position [mm]", "orientation [deg]"):
        assert rows[f"tracker residual, {name} / mink"].verdict == "met"
