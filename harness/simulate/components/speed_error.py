"""Error that grows with speed."""

from dataclasses import dataclass

from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class SpeedError:
    """Ranges are measured at another moment than the record's: an error along the velocity.

    Gilson et al. 2006 found errors that grow with speed; the size is inferred (docs/is900.md 13.3 and 13.5).
    """

    ahead_s: float = 0.002
    """Motion that is added [s]; negative lags behind."""

    def __post_init__(self) -> None:
        require_ranges(self, ahead_s=(-1.0, 1.0))

    def apply(self, sensed: SimulatedReadings) -> None:
        sensed.move(self.ahead_s * sensed.velocity_m_s)
