"""Strapdown integration."""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.simulate.physics.strapdown import (
    add_tick,
    attitude_sigma_rad,
    integrate,
    joseph_update,
    position_sigma_m,
    propagate_covariance,
)
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


DT = 1.0 / TICK_HZ


def integrated(motion: Floats, bias: Floats, angle: Floats, gain: Floats) -> Floats:
    for k in range(len(angle)):
        after = np.empty(10)
        integrate(motion, tuple(angle[k] - bias[:3] * DT), tuple(gain[k] - bias[3:] * DT), DT, after)
        motion = after
    return motion


def test_the_transition_is_the_slope_of_the_integration() -> None:
    station = free_station(1.0, 1, speed=3.0)
    angle, gain = station.angle_rad[:5], station.gain_m_s[:5]
    begin = np.concatenate([station.unit_position_m[0], station.unit_velocity_m_s[0], station.tracker_from_station[0]])
    transition, motion = np.zeros((9, 9)), begin
    for k in range(5):
        after = np.empty(10)
        add_tick(transition, tuple(motion[6:]), integrate(motion, tuple(angle[k]), tuple(gain[k]), DT, after), DT)
        motion = after
    whole = np.eye(15)
    whole[:9, 6:] += transition
    whole[:3, 3:6] = 5.0 * DT * np.eye(3)
    slope, step = np.empty((9, 15)), 1e-6
    for i in range(15):
        ends = []
        for sign in (1.0, -1.0):
            error = np.zeros(15)
            error[i] = sign * step
            moved = begin.copy()
            moved[:6] += error[:6]
            moved[6:] = rotations.multiply(rotations.exp(error[6:9]), begin[6:])
            # A bias that is larger than the estimate leaves that much in the corrected increments.
            ends.append(integrated(moved, error[9:], angle, gain))
        turn = rotations.log(rotations.multiply(ends[0][6:], rotations.inverse(ends[1][6:])))
        slope[:, i] = np.concatenate([ends[0][:6] - ends[1][:6], turn]) / (2.0 * step)
    np.testing.assert_allclose(slope, whole[:9], atol=2e-4)
    np.testing.assert_allclose(slope[:, :9], whole[:9, :9], atol=1e-7)

    rng = np.random.default_rng(0)
    root = rng.standard_normal((15, 15))
    covariance = root @ root.T
    expected = whole @ covariance @ whole.T
    propagate_covariance(covariance, transition, 5.0 * DT, np.empty((9, 15)))
    np.testing.assert_allclose(covariance, expected, rtol=1e-12, atol=1e-9)


def test_joseph_update_equals_the_dense_one_for_any_gain(rng: np.random.Generator) -> None:
    root = rng.standard_normal((15, 15))
    covariance, slope, noise = root @ root.T, np.zeros(15), 0.3
    slope[:9] = rng.standard_normal(9)
    column = covariance @ slope
    total = 1.1 * float(slope @ column + noise)  # a gain that is not the best one
    rest = np.eye(15) - np.outer(column / total, slope)
    expected = rest @ covariance @ rest.T + noise * np.outer(column, column) / total**2
    joseph_update(covariance, slope[:9], column, total, noise, np.empty(15))
    np.testing.assert_allclose(covariance, expected, rtol=1e-10, atol=1e-10)


def test_sigmas_are_roots_of_traces() -> None:
    covariance = np.diag(np.arange(15.0))
    assert position_sigma_m(covariance) == np.sqrt(3.0)
    assert attitude_sigma_rad(covariance) == np.sqrt(21.0)
