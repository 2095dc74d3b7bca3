"""The device's own time."""

from dataclasses import dataclass

from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class Clock:
    """A clock that was set to zero as the take begins, or before, and that does not run at the pace of the host's
    (docs/is900.md 13.5).

    Rounding to 32-bit milliseconds is the wire's doing and happens at every level.
    """

    offset_s: float = 0.0
    """What it shows when the take begins [s]."""
    drift_ppm: float = 20.0
    """How much faster it runs [1e-6]."""

    def __post_init__(self) -> None:
        require_ranges(self, offset_s=(0.0, 1e6), drift_ppm=(-1e5, 1e5))

    def apply(self, sensed: SimulatedReadings) -> None:
        sensed.device_s = self.offset_s + (1.0 + 1e-6 * self.drift_ppm) * sensed.time_s
