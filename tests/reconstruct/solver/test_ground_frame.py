"""The compiled functions for one pose against those for many, and the estimate of a heading."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.virtual_trackers import StationFeatures, VirtualTrackers
from harness.reconstruct.solver.ground_frame import (
    HeadingEstimator,
    ground_after_step,
    ground_from_qpos,
    posture_from_qpos,
    qpos_from_posture,
    qpos_from_postures,
    relative_ground,
)
from tests.reconstruct.conftest import Scene
from tests.reconstruct.conftest import moved as elsewhere


@pytest.mark.parametrize("yaw_rad", [0.0, 3.0, -2.0])
def test_standing_and_stepping(boxing: Scene, yaw_rad: float) -> None:
    qpos = elsewhere(boxing.take.qpos, yaw_rad, (3.0, 1.0, 0.0))[30]
    step = np.array([0.1, -0.2, 0.3])
    ground = ground_from_qpos(qpos)
    np.testing.assert_allclose(relative_ground(ground, ground_after_step(qpos, step)), step, atol=1e-12)
    posture = posture_from_qpos(qpos)
    np.testing.assert_allclose(qpos_from_posture(posture, ground), qpos_from_postures(posture, ground), atol=1e-12)


def test_readings_of_an_example_have_its_features(boxing: Scene) -> None:
    """Features of exact readings after a window equal those of the database."""
    windows = MotionDatabase.build(boxing.body, [boxing.take]).windows(2, with_successor=True)
    controls = StationFeatures(boxing.body, windows, boxing.calibration, 0.3)
    qpos = elsewhere(boxing.take.qpos, 2.0, (3.0, 1.0, 0.0))
    for row in (0, 40):
        before = int(windows.frames[row])
        at_m, turned = VirtualTrackers(boxing.body, boxing.calibration).station_poses(qpos[before + 1][None])
        found = controls.query(at_m[0], turned[0], ground_from_qpos(qpos[before]))
        np.testing.assert_allclose(found, controls.values[row], atol=1e-5)


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
