"""The room: floor, walls and ceiling that reflect sound, and furniture that blocks it."""

from dataclasses import dataclass
from typing import Annotated

from harness.core.ranges import Range, check_fields


@dataclass(frozen=True)
class Box:
    """A piece of furniture: a box whose sides are parallel to the walls."""

    centre_m: Annotated[tuple[float, float, float], Range(-100.0, 100.0)]
    """Centre: x and y from the middle of the room, z from the floor [m]."""
    size_m: Annotated[tuple[float, float, float], Range(0.01, 100.0)]
    """Length along x, y and z [m]."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Room:
    """A rectangular room, whose middle lies under the middle of the constellation; its floor is the world's z = 0."""

    size_m: Annotated[tuple[float, float], Range(1.0, 200.0)] = (12.0, 12.0)
    """Length along the world's x and y [m] [choice]."""
    height_m: Annotated[float, Range(1.5, 50.0)] = 2.6
    """Height of the ceiling [m]: 0.1 m above the emitters of the shipped constellations [choice]."""
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
