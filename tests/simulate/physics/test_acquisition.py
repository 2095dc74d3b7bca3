"""The fix and the level of a lost station."""

from typing import Any

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.simulate.physics.acquisition import cholesky_inverse, integrate_path, level_attitude, solve_position
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.filter_state import AcquisitionState
from harness.simulate.physics.fusion import FusionFilter
from harness.simulate.physics.inertial import Inertial
from harness.simulate.physics.tracking_status import reset_acquisition
from harness.simulate.readings import GRAVITY_M_S2
from tests.simulate.physics.free_station import (
    EMITTER_M,
    FreeStation,
    exact_inertial,
    free_station,
    new_filter,
    noisy,
    records_every,
)
from tests.simulate.physics.rooms import emitters_in_turn

SLOTS = 40


def searching(station: FreeStation, slots: int = SLOTS) -> FusionFilter:
    """A filter that has collected the ranges of some slots, and may not fix."""
    fusion_filter = new_filter(fusion=Fusion(), inertial=exact_inertial())
    fusion_filter.model = fusion_filter.model._replace(window_s=0.0)
    measured = station.angle_rad[: 5 * slots, None], station.gain_m_s[: 5 * slots, None], station.range_m[:slots, None]
    fusion_filter.filter_block(0, emitters_in_turn(0, slots), *measured, records_every(5, 0))
    return fusion_filter


def try_fix(fusion_filter: FusionFilter, window_s: float = 1.0) -> tuple[bool, Floats, Floats]:
    """Whether a fix was found, the motion, and P."""
    motion, covariance = fusion_filter.state.motion[0, -1].copy(), np.zeros((15, 15))
    return (
        solve_position(fusion_filter.model.ranging, fusion_filter.state.acquisition, 0, window_s, motion, covariance),
        motion,
        covariance,
    )


@pytest.mark.parametrize("speed", [0.0, 1.0, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_fix_is_as_good_as_it_says(seed: int, speed: float) -> None:
    station, _ = noisy(free_station(2.0, seed, speed=speed), seed, Inertial())
    found, motion, covariance = try_fix(searching(station))
    assert found
    end = 5 * SLOTS
    turn = rotations.log(rotations.multiply(station.tracker_from_station[end], rotations.inverse(motion[6:])))
    error = np.concatenate(
        [station.unit_position_m[end] - motion[:3], station.unit_velocity_m_s[end] - motion[3:6], turn]
    )
    assert error @ np.linalg.solve(covariance[:9, :9], error) < 30.0  # chi-square of 9: 0.04 % are larger
    assert np.sqrt(np.trace(covariance[:3, :3])) < 0.03


def test_a_fix_leaves_out_a_few_wrong_ranges() -> None:
    station, _ = noisy(free_station(2.0, 1), 1, Inertial())
    station.range_m[[5, 17, 30], 0] += np.array([0.5, 0.3, 1.0])
    found, motion, _ = try_fix(searching(station))
    assert found
    assert np.linalg.norm(motion[:3] - station.unit_position_m[5 * SLOTS]) < 0.03


def test_a_fix_is_refused_when_most_ranges_are_wrong(rng: np.random.Generator) -> None:
    station, _ = noisy(free_station(2.0, 1), 1, Inertial())
    station.range_m[:] += rng.uniform(0.0, 0.5, station.range_m.shape)
    assert not try_fix(searching(station))[0]


@pytest.mark.parametrize(("heard", "expected"), [((0, 1, 4), True), ((0, 4), False), ((0, 1, 2), False)])
def test_a_fix_needs_three_emitters_that_are_not_in_a_row(heard: tuple[int, ...], expected: bool) -> None:
    station, _ = noisy(free_station(2.0, 1), 1, Inertial())
    emitter = np.arange(len(station.range_m)) % 9
    station.range_m[~np.isin(emitter, heard)] = np.nan
    found, motion, _ = try_fix(searching(station))
    assert found == expected
    assert not found or np.linalg.norm(motion[:3] - station.unit_position_m[5 * SLOTS]) < 0.1


@pytest.mark.parametrize("late", [3, 5])
def test_a_fix_stands_although_most_ranges_are_echoes(late: int) -> None:
    """As if a floor reflected the sound of some emitters: their ranges agree with a place below it."""
    station, _ = noisy(free_station(2.0, 1), 1, Inertial())
    emitter = np.arange(len(station.range_m)) % 9
    mirrored = station.unit_position_m[::5][: len(emitter)] * [1.0, 1.0, -1.0] + [0.0, 0.0, 1.0]
    longer = np.linalg.norm(mirrored - EMITTER_M[emitter], axis=1)
    echoes = emitter >= 9 - late
    station.range_m[echoes] = longer[echoes, None]
    found, motion, _ = try_fix(searching(station))
    assert found
    assert np.linalg.norm(motion[:3] - station.unit_position_m[5 * SLOTS]) < 0.05


def test_a_fix_is_refused_where_several_ranges_are_early() -> None:
    station, _ = noisy(free_station(2.0, 1), 1, Inertial())
    station.range_m[[5, 17, 30]] -= 0.2
    assert not try_fix(searching(station))[0]


@pytest.mark.parametrize(
    ("limits", "expected"),
    [({}, True), ({"reach_m": 1.4}, False), ({"cone_cos": 0.9}, False), ({"threshold_db": -6.0}, False)],
)
def test_a_fix_is_refused_where_its_emitters_are_not_heard(limits: dict[str, Any], expected: bool) -> None:
    station, _ = noisy(free_station(2.0, 1), 1, Inertial())
    fusion_filter = searching(station)
    ranging = fusion_filter.model.ranging._replace(**limits)
    fusion_filter.model = fusion_filter.model._replace(ranging=ranging)
    assert try_fix(fusion_filter)[0] == expected


def test_a_fix_uses_the_window_only() -> None:
    station, _ = noisy(free_station(2.0, 1), 1, Inertial())
    station.range_m[:20] -= 0.7
    fusion_filter = searching(station)
    assert not try_fix(fusion_filter)[0]
    assert try_fix(fusion_filter, window_s=0.25)[0]


def test_gravity_levels_a_station_at_rest(rng: np.random.Generator) -> None:
    turn = rotations.exp(rng.standard_normal(3))  # of the true attitude; the kept one is the identity
    force = rotations.rotate(rotations.inverse(turn), np.array([0.0, 0.0, -GRAVITY_M_S2]))
    acquisition = AcquisitionState(
        np.zeros((1, 4, 12)), np.zeros(1, dtype=np.int64), np.zeros((1, 7)), np.zeros((1, 5)), np.zeros(1)
    )
    reset_acquisition(acquisition, 0, 1.0)
    motion = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    integrate_path(acquisition.path[0], force[0], force[1], force[2], 1.0)
    for _ in range(80):
        x, y, z = rotations.rotate(motion[6:], force)
        level_attitude(acquisition, 0, motion, x, y, z, 0.0125)
    kept = rotations.rotate(motion[6:], force)
    assert np.arctan2(np.hypot(kept[0], kept[1]), -kept[2]) < 0.01
    assert np.sqrt(acquisition.tilt_variance[0]) < 0.02
    np.testing.assert_allclose(acquisition.path[0, 3:6], kept, atol=1e-9)  # what was collected turns along


def test_invert_knows_matrices_that_are_not_definite(rng: np.random.Generator) -> None:
    root = rng.standard_normal((9, 9))
    matrix, inverse = root @ root.T, np.empty((9, 9))
    assert cholesky_inverse(matrix, inverse)
    np.testing.assert_allclose(inverse @ matrix, np.eye(9), atol=1e-8)
    assert not cholesky_inverse(matrix - 3.0 * np.trace(matrix) * np.eye(9), inverse)
    assert not cholesky_inverse(np.zeros((9, 9)), inverse)
