"""Stations whose orientation is off by a constant angle for a while: iron near the magnetometers."""

import math
from dataclasses import dataclass

import numpy as np

from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class OrientationOffset:
    """Orientations turned about the vertical from one moment to another, positions as they are. A fault.

    All stations turned alike agree with each other and contradict every position: the hard case.
    """

    stations: tuple[str, ...] = ()
    """Which; () is every one."""
    from_s: float = 0.0
    to_s: float = math.inf
    angle_rad: float = 0.0
    """About the tracker's z axis [rad]."""

    def __post_init__(self) -> None:
        require_ranges(self, to_s=(self.from_s, math.inf))

    def apply(self, sensed: SimulatedReadings) -> None:
        hit = sensed.during(self.stations, self.from_s, self.to_s)
        sensed.rotate(hit[:, :, None] * np.array([0.0, 0.0, self.angle_rad]))
        sensed.affected["orientation_offset"] = hit | sensed.affected.get("orientation_offset", False)
