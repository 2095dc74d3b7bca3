"""Faults that scenarios name: a lost station, and positions or orientations that are off for a period."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class LostStation:
    """Quality 0 from `from_s` to `to_s`; records keep coming (docs/is900.md 7). A fault that scenarios name."""

    station: str
    from_s: Annotated[float, Range(-1e6, 1e6)] = 0.0
    """Beginning of the loss [s]."""
    to_s: Annotated[float, Range(-1e6, math.inf)] = math.inf
    """End of the loss [s]."""
    fade_s: Annotated[float, Range(0.0, 1e6)] = 0.5
    """Time before `from_s` in which quality falls, as ranges become fewer (docs/is900.md 13.3) [s] [choice]."""

    def __post_init__(self) -> None:
        check_fields(self, to_s=Range(self.from_s, math.inf))

    def apply(self, readings: SimulatedReadings) -> None:
        lost = readings.mask((self.station,), self.from_s, self.to_s)
        row = readings.stations.index(self.station)
        left = np.clip((self.from_s - readings.time_s[:, row]) / max(self.fade_s, 1e-9), 1.0 / 255.0, 1.0)
        fading = readings.time_s[:, row] < self.from_s
        readings.quality[fading, row] = np.minimum(readings.quality[fading, row], left[fading])
        readings.hold_last_valid(lost)


@dataclass(frozen=True)
class PositionOffset:
    """Positions off by a constant vector from `from_s` to `to_s`; the quality does not show it. A fault."""

    stations: tuple[str, ...] = ()
    """Affected stations; () is all of them, as if the performer stood elsewhere."""
    from_s: Annotated[float, Range(-1e6, 1e6)] = 0.0
    """Beginning [s]."""
    to_s: Annotated[float, Range(-1e6, math.inf)] = math.inf
    """End [s]."""
    offset_m: Annotated[tuple[float, float, float], Range(-100.0, 100.0)] = (0.0, 0.0, 0.0)
    """Offset in the tracker's axes [m]."""

    def __post_init__(self) -> None:
        check_fields(self, to_s=Range(self.from_s, math.inf))

    def apply(self, readings: SimulatedReadings) -> None:
        hit = readings.mask(self.stations, self.from_s, self.to_s)
        readings.position_m = readings.position_m + hit[:, :, None] * self.offset_m
        readings.affected["position_offset"] = hit | readings.affected.get("position_offset", False)


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
