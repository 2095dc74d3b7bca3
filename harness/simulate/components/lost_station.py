"""A station that is out for a while, or for good."""

import math
from dataclasses import dataclass

import numpy as np

from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class LostStation:
    """Quality 0 from one moment to another; records keep coming (docs/is900.md 7). A fault that scenarios name."""

    station: str
    from_s: float = 0.0
    to_s: float = math.inf
    fade_s: float = 0.5
    """Quality falls for so long before `from_s`, as ranges become fewer (docs/is900.md 13.3; length: a choice)."""

    def __post_init__(self) -> None:
        require_ranges(self, to_s=(self.from_s, math.inf), fade_s=(0.0, math.inf))

    def apply(self, sensed: SimulatedReadings) -> None:
        lost = sensed.during((self.station,), self.from_s, self.to_s)
        row = sensed.stations.index(self.station)
        left = np.clip((self.from_s - sensed.time_s[:, row]) / max(self.fade_s, 1e-9), 1.0 / 255.0, 1.0)
        fading = sensed.time_s[:, row] < self.from_s
        sensed.quality[fading, row] = np.minimum(sensed.quality[fading, row], left[fading])
        sensed.lose(lost)
