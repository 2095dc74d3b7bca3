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


class Origin(IntEnum):
    """Which part of a method computed an estimate."""

    MODEL = 0
    """The method's own model, from readings of this frame."""
    FALLBACK = 1
    """A simpler solution instead of the model, such as inverse kinematics while there is no history yet."""
    BRIDGED = 2
    """No reading of this frame: the last pose again, or an extrapolation."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """One pose of the body, its status and its origin, in the form that is posed, rendered, exported and scored.

    Raises ShapeError for a pose that is no vector, and ValueError for an unknown status or origin.
    """

    qpos: Floats
    """(55,) root position [m], root quaternion (w, x, y, z), 48 hinge angles [rad]."""
    status: Status
    origin: Origin = Origin.MODEL
    """Part of the method that computed the pose. Tables print the share of frames that are not from the model."""

    def __post_init__(self) -> None:
        freeze(self, qpos=("Q",))
        object.__setattr__(self, "status", Status(self.status))
        object.__setattr__(self, "origin", Origin(self.origin))
