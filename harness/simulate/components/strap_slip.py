"""Random slips of any strap, for studies that compare sets of stations."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.ranges import Range, check_fields
from harness.simulate.components.mount import MountSlip
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class StrapSlip:
    """Each strap slips once in a take with probability `share`, at a uniformly random moment (see `MountSlip`).

    The slip is N(0, `along_m`) along the bone and N(0, `around_rad`) around it. In no noise preset; all numbers are
    choices. Each station has its own random draws, so it slips alike in every set of stations that contains it.
    """

    share: Annotated[float, Range(0.0, 1.0)] = 0.2
    """Probability that a strap slips."""
    along_m: Annotated[float, Range(0.0, 0.5)] = 0.01
    """Standard deviation of the slip along the bone [m]."""
    around_rad: Annotated[float, Range(0.0, math.pi)] = 0.15
    """Standard deviation of the slip around the bone [rad]."""
    over_s: Annotated[float, Range(0.0, 60.0)] = 0.5
    """Duration of a slip [s]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        begin_s, end_s = float(readings.time_s.min()), float(readings.time_s.max())
        for station in readings.stations:
            slip = self.draw(readings.take_rng("loose", station), station, begin_s, end_s)
            if slip is not None:
                slip.apply(readings)

    def draw(self, rng: np.random.Generator, station: str, begin_s: float, end_s: float) -> MountSlip | None:
        """The slip of a station in a take between two times [s]; None when its strap holds."""
        slips, when, along, around = rng.random() < self.share, rng.random(), rng.normal(), rng.normal()
        if not slips:
            return None
        return MountSlip(
            station,
            from_s=begin_s + when * (end_s - begin_s),
            over_s=self.over_s,
            around_rad=self.around_rad * around,
            along_m=self.along_m * along,
        )
