"""Position error that is proportional to velocity."""

from dataclasses import dataclass
from typing import Annotated

from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class SpeedError:
    """A timing error: ranges are measured at another moment than the record states.

    Gilson et al. 2006 found errors that grow with speed; the size is inferred (docs/is900.md 13.3 and 13.5).
    """

    ahead_s: Annotated[float, Range(-1.0, 1.0)] = 0.002
    """Time by which positions run ahead of the record's time stamp [s]; negative lags."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        readings.move(self.ahead_s * readings.velocity_m_s)
