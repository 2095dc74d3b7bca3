"""Level, time of flight, reflections and bursts of the ultrasound."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, minimize

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.simulate.physics.room import Room
from harness.simulate.physics.sound import (
    NOISE_AT_M,
    Bursts,
    level_db,
    mirror_images,
    noise_factor,
    reflection_point,
    threshold_db,
    time_of_flight_s,
)
from tests.simulate.physics.rooms import placed

ABSORPTION = 1.3
distances = st.floats(0.05, 10.0)
cosines = st.floats(0.0, 1.0)


def test_a_level_by_hand() -> None:
    assert level_db(1.0, 1.0, 1.0, ABSORPTION) == 0.0
    assert level_db(2.0, 1.0, 1.0, ABSORPTION) == pytest.approx(-20.0 * math.log10(2.0) - 1.3)
    assert level_db(1.0, 0.5, 1.0, ABSORPTION) == pytest.approx(20.0 * math.log10(0.5))
    assert level_db(1.0, 1.0, 0.0, ABSORPTION) == pytest.approx(20.0 * math.log10(0.5))
    assert level_db(1.0, 1.0, -0.5, ABSORPTION) == pytest.approx(20.0 * math.log10(0.25))


def test_behind_a_microphone_is_silence_and_no_error() -> None:
    assert -200.0 < level_db(1.0, 1.0, -1.0, ABSORPTION) < -100.0
    assert math.isfinite(level_db(0.0, 0.0, -1.0, ABSORPTION))


def test_the_threshold_is_the_level_at_the_corner_of_the_coverage() -> None:
    cone = math.radians(70.0)
    expected = 20.0 * math.log10(math.cos(cone) / 4.0) - 3.0 * ABSORPTION
    assert threshold_db(4.0, cone, ABSORPTION) == pytest.approx(expected)


@settings(deadline=None)
@given(distances, cosines, cosines)
def test_noise_is_inverse_to_the_amplitude_within_limits(distance_m: float, emitter: float, station: float) -> None:
    loss_db = level_db(NOISE_AT_M, 1.0, 1.0, ABSORPTION) - level_db(distance_m, emitter, station, ABSORPTION)
    factor = noise_factor(level_db(distance_m, emitter, station, ABSORPTION), ABSORPTION)
    assert 0.5 <= factor <= 4.0
    if 0.5 < factor < 4.0:
        assert 20.0 * math.log10(factor) == pytest.approx(loss_db, abs=1e-9)


def test_the_noise_is_specified_at_two_metres() -> None:
    assert noise_factor(level_db(2.0, 1.0, 1.0, ABSORPTION), ABSORPTION) == pytest.approx(1.0)
    assert noise_factor(0.0, ABSORPTION) == 0.5
    assert noise_factor(-60.0, ABSORPTION) == 4.0


TICK_S, SPEED = 1.0 / 400.0, 343.0


def track(seed: int, speed_m_s: float) -> tuple[Floats, Floats]:
    """Positions and velocities at six ticks of a microphone that swings through a point one to three metres away."""
    rng = generator(seed, "track")
    time_s = TICK_S * np.arange(6)
    where, way = rng.uniform(0.6, 1.7, 3), rng.standard_normal(3)
    way *= speed_m_s / np.linalg.norm(way)
    turn = 2.0 * np.pi * rng.uniform(1.0, 10.0)
    return (where + way * (np.sin(turn * time_s) / turn)[:, None], way * np.cos(turn * time_s)[:, None])


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


planes = placed(Room(size_m=(6.0, 5.0))).planes()


@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 5))
def test_an_echo_takes_the_shortest_way_over_its_plane(seed: int, which: int) -> None:
    """Fermat: the reflection point minimises the length of the path, which is the distance from the image."""
    rng = generator(seed, "echo")
    emitter_m, at_m = rng.uniform([-2.9, -2.4, 0.0], [2.9, 2.4, 2.4], (2, 3))
    normal, distance_m = planes[which, :3], planes[which, 3]
    across = np.linalg.svd(normal[None])[2][1:]

    def length_m(places: np.ndarray) -> float:
        point_m = distance_m * normal + places @ across
        return float(np.linalg.norm(point_m - emitter_m) + np.linalg.norm(at_m - point_m))

    shortest = minimize(length_m, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-13})
    image_m = mirror_images(planes, emitter_m[None])[0, which]
    bounce_m = np.zeros(3)
    assert reflection_point(planes[which], image_m, at_m, bounce_m)
    np.testing.assert_allclose(np.linalg.norm(image_m - at_m), shortest.fun, atol=1e-9)
    np.testing.assert_allclose(length_m(across @ bounce_m), shortest.fun, atol=1e-9)
    np.testing.assert_allclose(bounce_m @ normal, distance_m, atol=1e-9)
    np.testing.assert_allclose(bounce_m, distance_m * normal + shortest.x @ across, atol=1e-4)


def test_an_image_is_as_far_behind_each_plane_as_its_emitter_is_before_it() -> None:
    emitter_m = np.array([[0.3, -0.2, 0.4], [1.0, 1.0, 1.0]])
    images_m = mirror_images(planes, emitter_m)
    assert images_m.shape == (2, 6, 3)
    before_m = emitter_m @ planes[:, :3].T - planes[:, 3]
    behind_m = np.einsum("jpx,px->jp", images_m, planes[:, :3]) - planes[:, 3]
    assert (before_m < 0.0).all()
    np.testing.assert_allclose(behind_m, -before_m)


def test_a_point_behind_the_plane_has_no_reflection() -> None:
    image_m = mirror_images(planes, np.array([[0.0, 0.0, 0.5]]))[0, 0]
    assert not reflection_point(planes[0], image_m, np.array([0.0, 0.0, 2.6]), np.zeros(3))


def test_number_and_duration_are_those_of_the_settings() -> None:
    bursts = Bursts(2.0, (0.05, 0.3), seed=1, take="t")
    intervals_s = bursts.intervals_s(-30_000.0, 30_000.0)
    assert len(intervals_s) == pytest.approx(2000, abs=4.0 * np.sqrt(2000))
    duration_s = np.diff(intervals_s, axis=1)
    assert duration_s.min() >= 0.05 - 1e-9
    assert duration_s.max() <= 0.3 + 1e-9
    assert duration_s.mean() == pytest.approx(0.175, abs=0.01)


def test_bursts_do_not_depend_on_when_the_simulation_begins() -> None:
    edges_s: Floats = 0.0125 * np.arange(-4000.0, 12_001.0)
    whole = Bursts(30.0, (0.05, 2.0), seed=1, take="t").overlaps(edges_s[:-1], edges_s[1:])
    assert 0.1 < whole[:4000].mean() < 0.9
    for first in (1, 3999, 4000, 9000):
        part = Bursts(30.0, (0.05, 2.0), seed=1, take="t").overlaps(edges_s[first:-1], edges_s[first + 1 :])
        np.testing.assert_array_equal(part, whole[first:])


def test_a_burst_touches_the_intervals_that_it_overlaps() -> None:
    bursts = Bursts(20.0, (0.5, 1.0), seed=3, take="t")
    begins_s, ends_s = bursts.intervals_s(0.0, 60.0)[0]
    edges_s = np.array([begins_s - 0.2, begins_s - 0.1, begins_s + 0.1, begins_s + 0.2])
    np.testing.assert_array_equal(bursts.overlaps(edges_s[:-1], edges_s[1:]), [False, True, True])
    assert bursts.overlaps(np.array([ends_s - 0.01]), np.array([ends_s + 5.0])).all()


def test_a_burst_goes_on_over_the_minute() -> None:
    bursts = Bursts(30.0, (0.5, 2.0), seed=3, take="t")
    over = [(b, e) for b, e in bursts.intervals_s(0.0, 3600.0) if b // 60.0 != e // 60.0]
    assert over
    for _, ends_s in over:
        begin_s = np.array([ends_s // 60.0 * 60.0])
        assert Bursts(30.0, (0.5, 2.0), seed=3, take="t").overlaps(begin_s, begin_s + 1e-6).all()


def test_takes_and_seeds_differ() -> None:
    first = Bursts(2.0, (0.05, 0.3), seed=1, take="t").intervals_s(0.0, 600.0)
    for other in (Bursts(2.0, (0.05, 0.3), seed=2, take="t"), Bursts(2.0, (0.05, 0.3), seed=1, take="u")):
        assert not np.array_equal(other.intervals_s(0.0, 600.0), first)


def test_no_bursts() -> None:
    edges_s = np.arange(0.0, 600.0, 0.0125)
    assert not Bursts(0.0, (0.05, 0.3), seed=1, take="t").overlaps(edges_s[:-1], edges_s[1:]).any()
