"""Stations that read a constant distance off for a while: a receiver that took another for itself, a bad start."""

import math
from dataclasses import dataclass

from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class PositionOffset:
    """Positions off by one and the same vector from one moment to another; quality tells nothing of it. A fault."""

    stations: tuple[str, ...] = ()
    """Which; () is every one, as if the performer stood elsewhere."""
    from_s: float = 0.0
    to_s: float = math.inf
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Along the tracker's axes [m]."""

    def __post_init__(self) -> None:
        require_ranges(self, to_s=(self.from_s, math.inf))

    def apply(self, sensed: SimulatedReadings) -> None:
        hit = sensed.during(self.stations, self.from_s, self.to_s)
        sensed.position_m = sensed.position_m + hit[:, :, None] * self.offset_m
        sensed.affected["position_offset"] = hit | sensed.affected.get("position_offset", False)
