"""Simulated worlds of differences: their means, their bounds, and what a study of them counts."""

import numpy as np
import pytest

from harness.bench import interval_coverage
from harness.bench.interval_coverage import WORLDS, Coverage, World, coverage_rows, earlier_interval, measure_coverage
from harness.compare import mean_interval
from harness.core.seeds import generator

BY_NAME = {world.name: world for world in WORLDS}


@pytest.mark.parametrize("world", WORLDS, ids=lambda world: world.name)
def test_a_world_has_the_mean_that_its_studies_look_for(world: World) -> None:
    drawn = world.draw(generator(1, "world"), 40_000).mean(axis=1)
    assert drawn.mean() == pytest.approx(world.mean, abs=5.0 * drawn.std() / 200.0)
    assert np.mean(drawn != 0.0) == pytest.approx(world.differing, abs=0.02)


@pytest.mark.parametrize(("name", "size"), [("clusters of 2", 2), ("clusters of 3", 3)])
def test_clips_of_a_cluster_are_correlated(name: str, size: int) -> None:
    drawn = BY_NAME[name].draw(generator(1, "cluster"), 20_000)
    assert drawn.shape == (20_000, size)
    assert np.cov(drawn.T)[0, 1] == pytest.approx(0.8, abs=0.04)
    assert drawn.std() == pytest.approx(1.0, abs=0.02)


def test_the_bound_is_the_share_of_samples_with_a_unit_that_differs() -> None:
    world = BY_NAME["one unit in five differs"]
    assert world.bound(12) == pytest.approx(1.0 - 0.8**12)
    found = measure_coverage(world, 6, 300, 1, mean_interval)
    assert found.answered == pytest.approx(world.bound(6), abs=0.08)
    assert found.contained <= found.answered


def test_a_study_counts_what_its_interval_says() -> None:
    normal = BY_NAME["normal"]
    assert measure_coverage(normal, 8, 40, 1, lambda values, level: (-9.0, 9.0)) == Coverage(1.0, 1.0, 0.0, 0.0)
    above = measure_coverage(normal, 8, 200, 1, lambda values, level: (0.5, 0.6))
    assert (above.answered, above.contained, above.equivalent) == (1.0, 0.0, 1.0)
    assert 0.0 < above.alarms < 0.15, "a false alarm also needs the p of the sign flips"


def test_intervals_over_units_hold_where_those_over_clips_do_not() -> None:
    world = BY_NAME["clusters of 3"]
    ours, earlier = (measure_coverage(world, 8, 100, 1, of) for of in (mean_interval, earlier_interval))
    assert ours.contained >= 0.9
    assert earlier.contained <= 0.85


def test_each_world_and_number_of_units_has_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interval_coverage, "WORLDS", WORLDS[3:4])
    rows = coverage_rows(1, studies=5, units=(8, 12))
    assert [row.target for row in rows] == ["", "", "", "", ">= 92", "", "<= 5", ""]
    assert all("earlier version" in row.reference for row in rows)
    assert "at most 93.1% of samples differ" in rows[4].reference


@pytest.mark.slow
def test_intervals_hold_in_every_world() -> None:
    """Every target of the table, as `harness bench gate` prints it."""
    assert [row.text for row in coverage_rows(1) if row.verdict == "missed"] == []
