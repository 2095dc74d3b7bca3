"""Errors that stay the same for a session."""

from dataclasses import dataclass

from harness.core import rotations
from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class SessionBias:
    """The scale of space, by temperature (0.17 % per deg C), and where in its housing each station believes to be.

    Both normal, drawn once (docs/is900.md 13.3 and 13.5; the sizes are inferred).
    """

    scale: float = 0.001
    """Standard deviation of the scale error about the tracker's origin, common to all stations."""
    station_offset_m: float = 0.001
    """Standard deviation on each axis of a station [m]."""

    def __post_init__(self) -> None:
        require_ranges(self, scale=(0.0, 0.1), station_offset_m=(0.0, 1.0))

    def apply(self, sensed: SimulatedReadings) -> None:
        for row, station in enumerate(sensed.stations):
            offset_m = self.station_offset_m * sensed.session_rng("session", station).normal(size=3)
            sensed.position_m[:, row] += rotations.rotate(sensed.turn[:, row], offset_m)
        sensed.position_m *= 1.0 + self.scale * sensed.session_rng("session", "").normal()
