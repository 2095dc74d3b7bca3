"""Mount errors: trackers that are put on beside their nominal mounts, or that slip on their straps."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core import rotations
from harness.core.ranges import Range, check_fields
from harness.errors import UnknownName
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class MountOffset:
    """Constant normal offset of each tracker from its nominal mount, for a whole session. In no noise preset."""

    position_m: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Standard deviation along each axis of the station [m]."""
    orientation_rad: Annotated[float, Range(0.0, math.pi)] = 0.0
    """Standard deviation about each axis of the station [rad]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        for row, station in enumerate(readings.stations):
            draw = readings.session_rng("mount", station).normal(size=6)
            readings.position_m[:, row] += rotations.rotate(readings.turn[:, row], self.position_m * draw[:3])
            turn = rotations.exp(self.orientation_rad * draw[3:])
            readings.turn[:, row] = rotations.multiply(readings.turn[:, row], turn)


@dataclass(frozen=True)
class MountSlip:
    """A slip of one strap: the tracker moves around and along its bone, at once or slowly, and stays there."""

    station: str
    from_s: Annotated[float, Range(-1e6, 1e6)] = 0.0
    """Beginning of the slip [s]."""
    over_s: Annotated[float, Range(0.0, 1e6)] = 0.0
    """Duration of the slip [s]; 0 is a step."""
    around_rad: Annotated[float, Range(-100.0, 100.0)] = 0.0
    """Final angle about the bone, by the right-hand rule about the bone's direction [rad]."""
    along_m: Annotated[float, Range(-10.0, 10.0)] = 0.0
    """Final distance along the bone, towards its far end [m]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        if self.station not in readings.stations:
            raise UnknownName("station", self.station, readings.stations)
        row = readings.stations.index(self.station)
        since_s = readings.time_s[:, row] - self.from_s
        share = np.where(since_s < 0.0, 0.0, np.minimum(since_s / max(self.over_s, 1e-9), 1.0))
        share = np.where((since_s >= 0.0) & (self.over_s == 0.0), 1.0, share)
        # In the station's axes the bone runs along x, `radius_m` below the origin.
        angle = self.around_rad * share
        below = readings.radius_m[row] * np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle) - 1.0], axis=1)
        below[:, 0] = self.along_m * share
        readings.position_m[:, row] += rotations.rotate(readings.turn[:, row], below)
        around = rotations.exp(angle[:, None] * np.array([1.0, 0.0, 0.0]))
        readings.turn[:, row] = rotations.multiply(readings.turn[:, row], around)
