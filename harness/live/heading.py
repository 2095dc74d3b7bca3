"""The heading of a session: a turn of the world about the vertical, by which a performer faces forward again."""

from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, freeze

_LEAST_SHARE = 0.3
"""Least horizontal share of the direction that a pelvis faces; a performer who lies faces up or down [choice]."""


@dataclass(frozen=True, eq=False)
class WorldTurn:
    """A turn about the vertical and a shift along the floor, from the calibrated world to that of the outputs."""

    turn: Floats
    """(4,) unit quaternion about z."""
    shift_m: Floats
    """(3,) the calibrated origin in the world of the outputs [m]; its height is 0."""

    def __post_init__(self) -> None:
        freeze(self, turn=(4,), shift_m=(3,))

    @property
    def yaw_rad(self) -> float:
        """Angle of the turn, counter-clockwise seen from above [rad]."""
        return float(rotations.yaw_rad(self.turn))

    def pose(self, position_m: Floats, orientation: Floats) -> tuple[Floats, Floats]:
        """A position (3,) [m] and an orientation (4,) of the calibrated world in that of the outputs."""
        return rotations.rotate(self.turn, position_m) + self.shift_m, rotations.multiply(self.turn, orientation)

    def qpos(self, qpos: Floats) -> Floats:
        """A configuration (55,) in the world of the outputs."""
        out = np.array(qpos)
        out[:3], out[3:7] = self.pose(qpos[:3], qpos[3:7])
        return out

    def forward(self, qpos: Floats) -> "WorldTurn | None":
        """The turn by which a body in a configuration (55,) of the outputs faces x, in the place where it stands.

        None for a body whose pelvis faces up or down, and for none.
        """
        facing = rotations.rotate(qpos[3:7] / np.linalg.norm(qpos[3:7]), np.array([1.0, 0.0, 0.0]))
        if not np.hypot(facing[0], facing[1]) >= _LEAST_SHARE:  # NaN, too, is no pose
            return None
        back = rotations.about_z(-float(np.arctan2(facing[1], facing[0])))
        pivot_m = qpos[:3] * [1.0, 1.0, 0.0]
        shift_m = pivot_m + rotations.rotate(back, self.shift_m - pivot_m)
        return WorldTurn(rotations.multiply(back, self.turn), shift_m)


UNTURNED = WorldTurn(rotations.IDENTITY, np.zeros(3))
