"""Strapdown integration."""

import numpy as np

from harness.core import rotations
from harness.simulate.physics.strapdown import integrate
from harness.simulate.readings import GRAVITY_M_S2
from tests.simulate.physics.free_station import TICK_HZ, free_station


def test_free_fall_is_a_parabola() -> None:
    before, after = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), np.empty(10)
    assert integrate(before, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1, after) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(after[:6], [0.1, 0.0, 0.5 * GRAVITY_M_S2 * 0.01, 1.0, 0.0, GRAVITY_M_S2 * 0.1])


def test_exact_increments_give_the_motion_back() -> None:
    """Dead reckoning over 10 s of fast motion: 2 mm and 0.01 deg."""
    station = free_station(10.0, 8, speed=2.0)
    motion = np.concatenate([station.unit_position_m[0], station.unit_velocity_m_s[0], station.tracker_from_station[0]])
    for angle, gain in zip(station.angle_rad, station.gain_m_s, strict=True):
        after = np.empty(10)
        integrate(motion, tuple(angle), tuple(gain), 1.0 / TICK_HZ, after)
        motion = after
    assert np.linalg.norm(motion[:3] - station.unit_position_m[-1]) < 0.002
    assert np.degrees(rotations.angle_between_rad(motion[6:], station.tracker_from_station[-1])) < 0.01
