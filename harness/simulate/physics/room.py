"""The room: floor, walls and ceiling that reflect sound, and furniture that blocks it."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.core.ranges import CheckedFields, Range, check_fields
from harness.errors import BadInput
from harness.simulate.physics.constellation import Constellation

SMALLEST_M = 12.0, 12.0, 2.6
"""Length, width and height of a room that leaves them open, at least [m] [choice]."""
_WALL_GAP_M, _CEILING_GAP_M = 0.5, 0.1
"""Distance of its walls and its ceiling from what they hold, at least [m] [choice]."""


@dataclass(frozen=True)
class Box(CheckedFields):
    """A piece of furniture: a box whose sides are parallel to the walls."""

    centre_m: Annotated[tuple[float, float, float], Range(-100.0, 100.0)]
    """Centre: x and y from the middle of the room, z from the floor [m]."""
    size_m: Annotated[tuple[float, float, float], Range(0.01, 100.0)]
    """Length along x, y and z [m]."""


@dataclass(frozen=True)
class Room:
    """A rectangular room, whose middle lies under the middle of the constellation; its floor is the world's z = 0."""

    size_m: Annotated[tuple[float, float] | None, Range(1.0, 200.0)] = None
    """Length along the world's x and y [m]; by default that of `SMALLEST_M`, or more where emitters or motion need it.
    """
    height_m: Annotated[float | None, Range(1.5, 50.0)] = None
    """Height of the ceiling [m]; by default 0.1 m above the highest emitter, and that of `SMALLEST_M` at least."""
    reflection: Annotated[float, Range(0.0, 1.0)] = 0.7
    """Share of the amplitude that floor, walls and ceiling reflect [choice]."""
    shadow: bool = True
    """Whether the performer's body and the furniture block sound."""
    echoes: bool = True
    """Whether a reflection is heard where the direct sound is not."""
    furniture: tuple[Box, ...] = ()
    """Boxes that block sound."""

    def __post_init__(self) -> None:
        check_fields(self)
        length, width, height = self.extent_m
        low, high = (-length / 2, -width / 2, 0.0), (length / 2, width / 2, height)
        for number, box in enumerate(self.furniture, start=1):
            for centre, size, least, most in zip(box.centre_m, box.size_m, low, high, strict=True):
                if centre - size / 2 < least - 1e-9 or centre + size / 2 > most + 1e-9:
                    raise BadInput(f"Box {number} of room.furniture passes a wall.", "Make it smaller, or move it.")

    @property
    def extent_m(self) -> tuple[float, float, float]:
        """Length along x and y and height [m]; the least one where it is left open."""
        return *(self.size_m or SMALLEST_M[:2]), self.height_m or SMALLEST_M[2]


@dataclass(frozen=True, eq=False)
class PlacedRoom:
    """A room in the world, and the tracker's frame in it."""

    room: Room
    centre_m: Floats
    """(2,) world x and y of the middle of the room [m]."""
    world_from_tracker: Floats
    """(4,) unit quaternion."""
    origin_m: Floats
    """(3,) origin of the tracker's frame in the world [m]."""

    def __post_init__(self) -> None:
        freeze(self, centre_m=(2,), world_from_tracker=(4,), origin_m=(3,))

    def planes(self) -> Floats:
        """(6, 4) floor, ceiling and walls in the tracker's frame: outward unit normal and distance along it [m]."""
        (x, y), (length, width, height) = self.centre_m, self.room.extent_m
        normal = np.array([[0, 0, -1], [0, 0, 1], [-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]], dtype=float)
        distance_m = np.array([0.0, height, length / 2 - x, length / 2 + x, width / 2 - y, width / 2 + y])
        own = rotations.rotate(rotations.inverse(self.world_from_tracker), normal)
        return np.concatenate([own, (distance_m - np.sum(normal * self.origin_m, axis=1))[:, None]], axis=1)


def place_room(
    room: Room, constellation: Constellation, centre_m: Floats, calibration: Calibration
) -> tuple[Constellation, PlacedRoom]:
    """A constellation in the tracker's frame above a point (2,) of the world's floor [m], and the room around it."""
    placed = PlacedRoom(room, centre_m, calibration.world_from_tracker, calibration.tracker_origin_m)
    offset_m = np.array([*(centre_m - calibration.tracker_origin_m[:2]), 0.0])
    return constellation.translate(
        rotations.rotate(rotations.inverse(calibration.world_from_tracker), offset_m)
    ), placed


def check_room(room: Room, centre_m: Floats, name: str, position_m: Floats) -> None:
    """BadInput if a point of a path (N, 3), in world axes, lies outside the walls or above the ceiling [m].

    `name` is what moves on that path, for the message; `centre_m` is the middle of the room, world x and y.
    """
    (x, y), (length, width, height) = centre_m, room.extent_m
    low = np.array([x - length / 2, y - width / 2, -np.inf])
    high = np.array([x + length / 2, y + width / 2, height])
    outside = (position_m < low) | (position_m > high)
    if not np.any(outside):
        return
    row, axis = (int(at[0]) for at in np.nonzero(outside))
    at_m = float(position_m[row, axis])
    limit_m = float(low[axis] if at_m < low[axis] else high[axis])
    surface = "ceiling" if axis == 2 else "wall"
    raise BadInput(
        f"The room is too small: {name} reaches {'xyz'[axis]} = {at_m:.2f} m, and the {surface} is at {limit_m:.2f} m.",
        f"Make physics.room.{'height_m larger' if axis == 2 else 'size_m larger, or move constellation.centre_m'}.",
    )


def fit_room(room: Room, constellation: Constellation, origin_height_m: float, points_m: Floats) -> Room:
    """The room with the sizes that it leaves open: they hold J emitters and points (N, 2), from its middle [m].

    The constellation is in a tracker's frame whose origin is `origin_height_m` above the middle of the floor [m]. Walls
    are whole metres apart. BadInput if an emitter hangs outside the walls or above the ceiling.
    """
    hanging_m = constellation.position_m * [1.0, 1.0, -1.0] + [0.0, 0.0, origin_height_m]  # the frame's z points down
    reach_m = np.max(np.abs(np.concatenate([points_m, hanging_m[:, :2]])), axis=0)
    length, width = np.maximum(SMALLEST_M[:2], np.ceil(2.0 * (reach_m + _WALL_GAP_M))).tolist()
    height = max(SMALLEST_M[2], float(np.max(hanging_m[:, 2])) + _CEILING_GAP_M)
    out = replace(room, size_m=room.size_m or (length, width), height_m=room.height_m or height)
    for number, place_m in zip(constellation.number.tolist(), hanging_m, strict=True):
        check_room(out, np.zeros(2), f"emitter {number}", place_m[None])
    return out
