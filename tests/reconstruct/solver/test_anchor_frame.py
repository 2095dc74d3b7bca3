"""Headings estimated from positions."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.reconstruct.solver.ground_frame import HeadingEstimator

EVERY: Bools = np.ones(4, bool)


@pytest.fixture
def stations() -> Floats:
    """(200, 4, 3) stations of performers who face along x, two of them in front; the anchor is the last."""
    rng = np.random.default_rng(3)
    middle = np.array([[0.5, 0.3, 1.0], [0.5, -0.3, 1.0], [0.0, 0.0, 1.7], [0.0, 0.0, 1.3]])
    scatter = rng.normal(0.0, 0.1, (200, 4, 3))
    return middle + scatter + rng.normal(0.0, 2.0, (200, 1, 3))


def test_a_bearing_tells_the_heading_and_turns_with_the_performer(stations: Floats) -> None:
    bearing = HeadingEstimator.fit(stations, 3, EVERY)
    found = bearing.heading_rad(stations)
    assert 0.9 < bearing.explained < 1.0
    assert np.sqrt(np.mean(found**2)) < np.deg2rad(15.0)
    turned = np.array([3.0, -4.0, 0.2]) + rotations.rotate(rotations.about_z(1.2), stations)
    np.testing.assert_allclose(bearing.heading_rad(turned), found + 1.2, atol=1e-9)


def test_only_those_asked_count(stations: Floats) -> None:
    bearing = HeadingEstimator.fit(stations, 3, np.array([True, True, False, True]))
    away = np.array(stations)
    away[:, 2] += 5.0
    np.testing.assert_array_equal(bearing.heading_rad(away), bearing.heading_rad(stations))


def test_what_lies_all_around_tells_little(stations: Floats) -> None:
    for asked in ([False, False, True, True], [False, False, False, True]):
        assert HeadingEstimator.fit(stations, 3, np.array(asked)).explained < 0.1
