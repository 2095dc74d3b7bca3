"""Walls, ceiling and furniture."""

import numpy as np
import pytest

from harness.errors import BadInput
from harness.simulate.physics.room import Box, Room, check_room, fit_room
from tests.simulate.physics.rooms import ORIGIN_M, emitters_at, placed

CENTRE_M = np.array([1.0, -2.0])


def test_planes_pass_the_middles_of_walls_floor_and_ceiling_and_point_outward() -> None:
    room = placed(Room(size_m=(6.0, 4.0), height_m=2.6), CENTRE_M)
    x, y = CENTRE_M
    middles = np.array([[x, y, 0], [x, y, 2.6], [x - 3, y, 1], [x + 3, y, 1], [x, y - 2, 1], [x, y + 2, 1]])
    inside_m = np.array([x, y, 1.3])
    planes = room.planes()
    for (*normal, distance_m), middle_m in zip(planes, middles, strict=True):
        # The tracker's frame: x the same, y and z turned over.
        own_m = (middle_m - ORIGIN_M) * [1.0, -1.0, -1.0]
        np.testing.assert_allclose(np.dot(normal, own_m), distance_m, atol=1e-12)
        assert np.dot(normal, (inside_m - ORIGIN_M) * [1.0, -1.0, -1.0]) < distance_m


@pytest.mark.parametrize(
    ("point", "words"),
    [
        ((4.1, -2.0, 1.0), "x = 4.10 m, and the wall is at 4.00 m"),
        ((-2.1, -2.0, 1.0), "x = -2.10 m, and the wall is at -2.00 m"),
        ((1.0, 0.2, 1.0), "y = 0.20 m, and the wall is at 0.00 m"),
        ((1.0, -2.0, 2.7), "z = 2.70 m, and the ceiling is at 2.60 m"),
    ],
)
def test_a_path_that_passes_a_wall_or_the_ceiling_is_refused(point: tuple[float, ...], words: str) -> None:
    path_m = np.array([[1.0, -2.0, 1.0], point])
    with pytest.raises(BadInput, match="left_hand reaches " + words.replace(".", r"\.")):
        check_room(Room(size_m=(6.0, 4.0)), CENTRE_M, "left_hand", path_m)


POINTS_M = np.array([[5.4, -1.0], [-3.0, 5.5]])
HANGING_M = (-2.0, 1.0, 0.0), (1.0, 0.0, 2.4), (-5.4, 0.0, 0.0)


@pytest.mark.parametrize(
    ("move_m", "height_m", "fitted_m"),
    [
        (0.0, 2.5, (12.0, 12.0, 2.6)),
        (-0.2, 2.5, (12.0, 12.0, 2.6)),
        (0.2, 2.5, (13.0, 13.0, 2.6)),
        (-2.7, 3.0, (13.0, 12.0, 3.1)),
    ],
)
def test_sizes_that_are_left_open_hold_motion_and_emitters(
    move_m: float, height_m: float, fitted_m: tuple[float, float, float]
) -> None:
    """Walls keep 0.5 m from the farthest point and whole metres from each other, the ceiling 0.1 m."""
    room = fit_room(Room(), emitters_at(*HANGING_M), height_m, POINTS_M + move_m)
    assert room.extent_m == fitted_m
    assert Room().extent_m == (12.0, 12.0, 2.6)


def test_far_emitters_move_the_walls() -> None:
    assert fit_room(Room(), emitters_at((0.0, 7.1, 0.0)), 2.5, POINTS_M).extent_m == (12.0, 16.0, 2.6)


def test_sizes_that_are_given_stay() -> None:
    few = emitters_at(*HANGING_M[:2])
    assert fit_room(Room(size_m=(6.0, 4.0)), few, 3.0, POINTS_M).extent_m == (6.0, 4.0, 3.1)
    assert fit_room(Room(height_m=2.5), few, 2.5, POINTS_M + 2.0).extent_m == (16.0, 16.0, 2.5)


def test_a_path_inside_is_accepted_and_so_is_a_foot_below_the_floor() -> None:
    check_room(Room(size_m=(6.0, 4.0)), CENTRE_M, "left_foot", np.array([[3.9, -0.1, -0.01], [-1.9, -3.9, 2.59]]))


@pytest.mark.parametrize(
    ("centre", "size"),
    [((2.9, 0, 0.5), (0.4, 1, 1)), ((0, -1.9, 0.5), (1, 0.4, 1)), ((0, 0, 2.5), (1, 1, 0.4)), ((0, 0, 0.1), (1, 1, 1))],
)
def test_furniture_that_passes_a_wall_is_refused(centre: tuple[float, ...], size: tuple[float, ...]) -> None:
    with pytest.raises(BadInput, match=r"Box 2 of room\.furniture passes a wall"):
        Room(size_m=(6.0, 4.0), furniture=(Box((0.0, 0.0, 0.5), (1.0, 1.0, 1.0)), Box(centre, size)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("room", "says"),
    [
        (Room(size_m=(2.0, 12.0)), "emitter 1 reaches x = 1.50 m, and the wall is at 1.00 m"),
        (Room(size_m=(12.0, 2.0)), "emitter 2 reaches y = 1.20 m, and the wall is at 1.00 m"),
        (Room(height_m=2.3), "emitter 2 reaches z = 2.40 m, and the ceiling is at 2.30 m"),
    ],
)
def test_emitters_outside_a_given_room_are_refused(room: Room, says: str) -> None:
    """The tracker's z points down from 2.5 m above the floor."""
    emitters = emitters_at((0.0, 0.0, 0.4), (1.5, 0.0, 0.3), (0.0, 1.2, 0.1))
    with pytest.raises(BadInput) as refusal:
        fit_room(room, emitters, 2.5, np.zeros((0, 2)))
    assert says in str(refusal.value)
