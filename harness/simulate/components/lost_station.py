"""A station that is out for a while, or for good."""

import math
from dataclasses import dataclass

from harness.errors import UnknownName
from harness.simulate.limits import require
from harness.simulate.sensed import Sensed


@dataclass(frozen=True)
class LostStation:
    """Quality 0 from one moment to another; records keep coming (docs/is900.md 7). A fault that scenarios name."""

    station: str
    from_s: float = 0.0
    to_s: float = float("inf")

    def __post_init__(self) -> None:
        require(self, to_s=(self.from_s, math.inf))

    def spoil(self, sensed: Sensed) -> None:
        if self.station not in sensed.stations:
            raise UnknownName("station", self.station, sensed.stations)
        lost = (sensed.time_s >= self.from_s) & (sensed.time_s < self.to_s)
        lost[:, [row for row, name in enumerate(sensed.stations) if name != self.station]] = False
        sensed.lose(lost)
