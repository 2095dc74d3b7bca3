"""True motion of trackers in the tracker's frame, block after block of ticks."""

from dataclasses import dataclass
from typing import Protocol

from harness.core import rotations
from harness.core.arrays import Floats


@dataclass(frozen=True, eq=False)
class TrackerMotion:
    """True motion of the origins of S stations at the T + 1 ticks of a block; the last tick begins the next block.

    Everything is in the tracker's frame: x forward, y right, z down.
    """

    time_s: Floats
    """(T+1,) times [s]."""
    position_m: Floats
    """(T+1, S, 3) positions [m]."""
    tracker_from_station: Floats
    """(T+1, S, 4) unit quaternions, signs continuous in time, also from block to block."""
    velocity_m_s: Floats
    """(T+1, S, 3) velocities: the derivatives of the positions [m/s]."""
    turn_rad_s: Floats
    """(T+1, S, 3) angular velocities in the tracker's axes [rad/s]."""

    def points(self, offset_m: Floats) -> tuple[Floats, Floats]:
        """Positions [m] and velocities [m/s], (T+1, S, 3), of a point (3,) fixed to each station, in its axes [m]."""
        arm_m = rotations.rotate(self.tracker_from_station, offset_m)
        return self.position_m + arm_m, self.velocity_m_s + rotations.cross(self.turn_rad_s, arm_m)


class TrackerMotionSource(Protocol):
    """True motion of stations, in a body's motion or free."""

    @property
    def stations(self) -> tuple[str, ...]: ...

    def advance(self, time_s: Floats) -> TrackerMotion:
        """Motion at the ticks (T+1,) of the next block [s]. Blocks follow one another; the result may depend on all."""
        ...

    def qpos(self, time_s: Floats) -> Floats | None:
        """(F, 55) configurations of the body at F times [s]; None when no body is in the room."""
        ...
