"""Time of flight to a moving microphone, beside a fine solution."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.simulate.physics.sound import time_of_flight_s

TICK_S, SPEED = 1.0 / 400.0, 343.0


def track(seed: int, speed_m_s: float) -> tuple[Floats, Floats]:
    """Positions and velocities at six ticks of a microphone that swings through a point one to three metres away."""
    rng = generator(seed, "track")
    time_s = TICK_S * np.arange(6)
    where, way = rng.uniform(0.6, 1.7, 3), rng.standard_normal(3)
    way *= speed_m_s / np.linalg.norm(way)
    turn = 2.0 * np.pi * rng.uniform(1.0, 10.0)
    return (
        where + way * (np.sin(turn * time_s) / turn)[:, None],
        way * np.cos(turn * time_s)[:, None],
    )


@settings(deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 20.0))
def test_it_equals_a_fine_solution_to_a_nanometre(seed: int, speed_m_s: float) -> None:
    source_m = np.array([0.0, 0.1, -0.2])
    position_m, velocity_m_s = track(seed, speed_m_s)
    spline = CubicHermiteSpline(TICK_S * np.arange(6), position_m, velocity_m_s)

    def late_m(time_s: float) -> float:
        return float(np.linalg.norm(spline(time_s) - source_m) - SPEED * time_s)

    time_s = time_of_flight_s(source_m, position_m, velocity_m_s, TICK_S, SPEED)
    if late_m(5 * TICK_S) > 0.0:
        assert np.isnan(time_s)
    else:
        expected_s = brentq(late_m, 0.0, 5 * TICK_S, xtol=1e-16, rtol=1e-15)
        assert abs(time_s - expected_s) * SPEED < 1e-9


def test_motion_during_the_flight_counts() -> None:
    time_s = TICK_S * np.arange(6)
    velocity_m_s = np.tile([10.0, 0.0, 0.0], (6, 1))
    position_m = np.array([2.0, 0.0, 0.0]) + time_s[:, None] * velocity_m_s
    got_s = time_of_flight_s(np.zeros(3), position_m, velocity_m_s, TICK_S, SPEED)
    np.testing.assert_allclose(got_s, 2.0 / (SPEED - 10.0), rtol=1e-12)


def test_sound_that_arrives_after_the_last_tick_is_not_heard() -> None:
    at_rest = np.zeros((6, 3))
    reach_m = 5 * TICK_S * SPEED
    for distance_m, heard in ((0.999 * reach_m, True), (1.001 * reach_m, False)):
        position_m = np.tile([distance_m, 0.0, 0.0], (6, 1))
        time_s = time_of_flight_s(np.zeros(3), position_m, at_rest, TICK_S, SPEED)
        assert np.isnan(time_s) != heard


def test_a_microphone_that_comes_nearer_within_the_slot_is_heard() -> None:
    velocity_m_s = np.tile([-10.0, 0.0, 0.0], (6, 1))
    position_m = np.array([4.35, 0.0, 0.0]) + (TICK_S * np.arange(6))[:, None] * velocity_m_s
    time_s = time_of_flight_s(np.zeros(3), position_m, velocity_m_s, TICK_S, SPEED)
    np.testing.assert_allclose(time_s, 4.35 / (SPEED + 10.0), rtol=1e-12)
