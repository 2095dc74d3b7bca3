"""Error of the device's clock."""

from dataclasses import dataclass

from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class Clock:
    """Offset and constant drift of the device's clock against true time (docs/is900.md 13.5).

    Rounding to 32-bit milliseconds is part of the wire format and happens with every noise preset.
    """

    offset_s: float = 0.0
    """Reading of the clock at the beginning of the take [s]."""
    drift_ppm: float = 20.0
    """Rate error; positive runs faster [1e-6]."""

    def __post_init__(self) -> None:
        require_ranges(self, offset_s=(0.0, 1e6), drift_ppm=(-1e5, 1e5))

    def apply(self, readings: SimulatedReadings) -> None:
        readings.device_s = self.offset_s + (1.0 + 1e-6 * self.drift_ppm) * readings.time_s
