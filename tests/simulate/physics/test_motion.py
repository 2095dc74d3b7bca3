"""Kinematics of worn stations: those of the trajectory, for all stations and several frames of the tracker."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import Body
from harness.core import rotations
from harness.core.motion import BodyMotion
from harness.simulate.physics.motion import station_chain, station_states
from harness.simulate.simulation import TrackerConfig, exact_calibration
from harness.simulate.trajectory import Trajectory
from tests.simulate.conftest import worn

STATIONS = ("left_wrist", "right_hand", "left_ankle", "right_foot", "torso", "head", "pelvis")


@pytest.mark.parametrize("turned", [False, True])
def test_states_are_those_of_the_trajectory(boxer: tuple[Body, BodyMotion], turned: bool) -> None:
    body, take = boxer
    calibration = exact_calibration(body, worn(*STATIONS), TrackerConfig(origin_m=(0.1, 0.2, 2.5)))
    if turned:
        calibration = replace(calibration, world_from_tracker=rotations.exp(np.array([0.3, -0.8, 1.2])))
    trajectory = Trajectory(body, take).with_lead_in(1.0)
    time_s = np.arange(-1.0, trajectory.duration_s, 0.0123)
    true = trajectory.station_motion(calibration, np.repeat(time_s[:, None], len(STATIONS), axis=1))
    spline = trajectory.spline
    found, acceleration_m_s2 = station_states(station_chain(body.skeleton, calibration), spline.c, spline.x, time_s)
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    for ours, theirs in (
        (found.position_m, true.position_m - calibration.tracker_origin_m),
        (found.velocity_m_s, true.velocity_m_s),
        (found.turn_rad_s, true.turn_rad_s),
        (acceleration_m_s2, true.acceleration_m_s2),
    ):
        np.testing.assert_allclose(ours, rotations.rotate(tracker_from_world, theirs), atol=1e-9)
    turn = rotations.multiply(tracker_from_world, true.world_from_station)
    # alike, signs too, but for the sign of the first
    sign = np.copysign(1.0, np.sum(found.tracker_from_station[0] * turn[0], axis=-1, keepdims=True))
    np.testing.assert_allclose(found.tracker_from_station, sign * turn, atol=1e-12)
