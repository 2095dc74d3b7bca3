"""The compiled functions for one pose against those for many poses."""

import numpy as np
import pytest

from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.features.virtual_trackers import StationFeatures, VirtualTrackers
from harness.reconstruct.solver.ground_frame import (
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
