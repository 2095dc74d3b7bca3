"""Error of the device's clock."""

from dataclasses import dataclass
from typing import Annotated

from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class Clock:
    """Offset and constant drift of the device's clock against true time (docs/is900.md 13.5).

    Rounding to 32-bit milliseconds is part of the wire format and happens with every noise preset.
    """

    offset_s: Annotated[float, Range(0.0, 1e6)] = 0.0
    """Reading of the clock at the beginning of the take [s]."""
    drift_ppm: Annotated[float, Range(-1e5, 1e5)] = 20.0
    """Rate error; positive runs faster [1e-6]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        readings.device_s = self.offset_s + (1.0 + 1e-6 * self.drift_ppm) * readings.time_s
