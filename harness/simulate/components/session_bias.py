"""Errors that are constant for a session."""

from dataclasses import dataclass
from typing import Annotated

from harness.core import rotations
from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class SessionBias:
    """Scale error of all positions, by temperature (0.17 % per deg C), and offset of each station in its housing.

    Both are normal and drawn once per session (docs/is900.md 13.3 and 13.5; the sizes are inferred).
    """

    scale: Annotated[float, Range(0.0, 0.1)] = 1e-3
    """Standard deviation of the scale error about the tracker's origin, common to all stations."""
    station_offset_m: Annotated[float, Range(0.0, 1.0)] = 1e-3
    """Standard deviation of the offset on each axis of a station [m]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        for row, station in enumerate(readings.stations):
            offset_m = self.station_offset_m * readings.session_rng("session", station).normal(size=3)
            readings.position_m[:, row] += rotations.rotate(readings.turn[:, row], offset_m)
        readings.position_m *= 1.0 + self.scale * readings.session_rng("session", "").normal()
