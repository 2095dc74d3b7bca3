"""The approximate pose of a performer: what the stations tell, and the wanted pose where they tell nothing."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import Kinematics, locate_mounts
from harness.calibrate.performer_preview import PerformerPreview
from harness.core.arrays import Floats
from harness.stream import TrackerFrame
from tests.calibrate.test_pose_classifier import MOUNTS, body, classifier, hold, poses


def preview() -> PerformerPreview:
    return PerformerPreview(body(), MOUNTS, poses(), classifier())


def frame(pose: int) -> TrackerFrame:
    readings, count = hold(pose), len(MOUNTS)
    seen, none = np.ones(count, bool), np.zeros(count, bool)
    return TrackerFrame(
        0.0, np.zeros(count), readings.position_m, readings.tracker_from_station, seen, seen, np.ones(count), none
    )


def reached_m(qpos: Floats) -> Floats:
    """(S, 3) where the stations of a configuration are."""
    kinematics = Kinematics(body())
    kinematics.set(qpos)
    return kinematics.station_poses(*locate_mounts(body().skeleton, MOUNTS))[0]


@pytest.mark.parametrize("pose", [0, 4])
def test_a_pose_held_as_shown_is_that_pose(pose: int) -> None:
    found = preview().estimate(pose, frame(pose))
    assert found is not None
    np.testing.assert_allclose(found.qpos, poses()[pose], atol=1e-5)
    np.testing.assert_allclose(found.distance_m, 0.0, atol=1e-6)


def test_another_pose_is_reached_by_its_stations() -> None:
    found = preview().estimate(0, frame(2))
    assert found is not None
    at_m, _ = classifier().aligned_m(0, hold(2).position_m)
    reached = reached_m(found.qpos)
    np.testing.assert_allclose(reached - reached.mean(axis=0), at_m - at_m.mean(axis=0), atol=0.03)
    assert found.distance_m.max() > 0.25
    assert np.sqrt(np.mean(found.distance_m**2)) == pytest.approx(classifier().distances_m(hold(2))[0])


def test_a_station_without_a_reading_keeps_its_place() -> None:
    whole = frame(3)
    lost = np.array([True, False, False, False])
    silent = replace(whole, position_valid=~lost, position_m=np.where(lost[:, None], np.nan, whole.position_m))
    shown = preview()
    assert shown.estimate(3, silent) is None
    first = shown.estimate(3, whole)
    again = shown.estimate(3, silent)
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.qpos, again.qpos)
