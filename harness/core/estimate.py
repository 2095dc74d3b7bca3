"""What a reconstructor answers for one frame."""

from dataclasses import dataclass
from enum import IntEnum

from harness.core.arrays import Floats, freeze


class Status(IntEnum):
    """How far an estimate rests on readings."""

    SOLVED = 0
    HELD = 1
    """Too little came in; the pose is carried on from before."""
    LOST = 2
    """Fewer than half of the configured stations for more than 0.5 s."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """One pose of the body: every output can be posed, rendered, exported and scored in one way.

    ShapeError for a pose that is no vector, ValueError for a status that there is not.
    """

    qpos: Floats
    """(55,) root position [m], root quaternion (w, x, y, z), 48 hinge angles [rad]."""
    status: Status

    def __post_init__(self) -> None:
        freeze(self, qpos=("Q",))
        object.__setattr__(self, "status", Status(self.status))
