"""The estimate that a reconstructor returns for one frame."""

from dataclasses import dataclass
from enum import IntEnum

from harness.core.arrays import Floats, freeze


class Status(IntEnum):
    """How much an estimate depends on present readings."""

    SOLVED = 0
    HELD = 1
    """There were too few readings; the pose is extrapolated from earlier ones."""
    LOST = 2
    """For more than 0.5 s fewer than half of the configured stations had readings."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """One pose of the body and its status, in the form that is posed, rendered, exported and scored.

    Raises ShapeError for a pose that is no vector, and ValueError for an unknown status.
    """

    qpos: Floats
    """(55,) root position [m], root quaternion (w, x, y, z), 48 hinge angles [rad]."""
    status: Status

    def __post_init__(self) -> None:
        freeze(self, qpos=("Q",))
        object.__setattr__(self, "status", Status(self.status))
