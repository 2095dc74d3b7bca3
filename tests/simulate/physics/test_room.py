"""Walls, ceiling and furniture."""

import numpy as np
import pytest

from harness.errors import BadInput
from harness.simulate.physics.room import Box, Room, check_emitters, check_room
from tests.simulate.physics.rooms import ORIGIN_M, placed

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
        np.testing.assert_allclose(room.to_world(own_m), middle_m, atol=1e-12)


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


POINTS_M, EMITTERS_M = np.array([[5.4, -1.0], [-3.0, 5.5]]), np.array([[-2.0, 1.0, 2.5], [1.0, 0.0, 0.1]])


def test_sizes_that_are_left_open_hold_motion_and_emitters() -> None:
    assert Room().fit(POINTS_M, EMITTERS_M).extent_m == Room().extent_m == (12.0, 12.0, 2.6)
    assert Room().fit(POINTS_M - [0.2, 0.0], EMITTERS_M).extent_m == (12.0, 12.0, 2.6)
    assert Room().fit(POINTS_M + 0.2, EMITTERS_M).extent_m == (13.0, 13.0, 2.6)
    assert Room().fit(POINTS_M, EMITTERS_M - [4.0, 0.0, -0.5]).extent_m == (13.0, 12.0, 3.1)


def test_sizes_that_are_given_stay() -> None:
    assert Room((6.0, 4.0)).fit(POINTS_M, EMITTERS_M - [0.0, 0.0, -0.5]).extent_m == (6.0, 4.0, 3.1)
    assert Room(height_m=2.2).fit(POINTS_M + 2.0, EMITTERS_M).extent_m == (16.0, 16.0, 2.2)


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
        (Room(size_m=(2.0, 12.0)), "Emitter 2 hangs outside the walls, at (1.50, 0.00) m"),
        (Room(size_m=(12.0, 2.0)), "Emitter 3 hangs outside the walls, at (0.00, 1.20) m"),
        (Room(height_m=2.3), "Emitter 3 hangs at 2.40 m, above the ceiling at 2.30 m"),
    ],
)
def test_emitters_outside_the_room_are_refused(room: Room, says: str) -> None:
    """The tracker's z points down from 2.5 m above the floor."""
    number, position_m = np.array([1, 2, 3]), np.array([[0.0, 0.0, 0.4], [1.5, 0.0, 0.3], [0.0, 1.2, 0.1]])
    check_emitters(Room(), 2.5, number, position_m)
    with pytest.raises(BadInput) as refusal:
        check_emitters(room, 2.5, number, position_m)
    assert says in str(refusal.value)
