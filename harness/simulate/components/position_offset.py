"""Constant position error of stations for a period, such as a confused receiver or a bad start causes."""

import math
from dataclasses import dataclass
from typing import Annotated

from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


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
