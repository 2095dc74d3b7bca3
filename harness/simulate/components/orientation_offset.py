"""Constant heading error of stations for a period, such as iron near the magnetometers causes."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class OrientationOffset:
    """Orientations rotated about the vertical from `from_s` to `to_s`; positions are correct. A fault.

    The hard case rotates all stations alike: they agree with each other and contradict every position.
    """

    stations: tuple[str, ...] = ()
    """Affected stations; () is all of them."""
    from_s: Annotated[float, Range(-1e6, 1e6)] = 0.0
    """Beginning [s]."""
    to_s: Annotated[float, Range(-1e6, math.inf)] = math.inf
    """End [s]."""
    angle_rad: Annotated[float, Range(-100.0, 100.0)] = 0.0
    """Angle about the tracker's z axis [rad]."""

    def __post_init__(self) -> None:
        check_fields(self, to_s=Range(self.from_s, math.inf))

    def apply(self, readings: SimulatedReadings) -> None:
        hit = readings.mask(self.stations, self.from_s, self.to_s)
        readings.rotate(hit[:, :, None] * np.array([0.0, 0.0, self.angle_rad]))
        readings.affected["orientation_offset"] = hit | readings.affected.get("orientation_offset", False)
