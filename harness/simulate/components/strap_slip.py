"""Random slips of any strap, for studies that compare sets of stations."""

import math
from dataclasses import dataclass

from harness.simulate.components.mount import MountSlip
from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class StrapSlip:
    """Each strap slips once in a take with probability `share`, at a uniformly random moment (see `MountSlip`).

    The slip is N(0, `along_m`) along the bone and N(0, `around_rad`) around it. In no noise preset; all numbers are
    choices. Each station has its own random draws, so it slips alike in every set of stations that contains it.
    """

    share: float = 0.2
    """Probability that a strap slips."""
    along_m: float = 0.01
    """Standard deviation of the slip along the bone [m]."""
    around_rad: float = 0.15
    """Standard deviation of the slip around the bone [rad]."""
    over_s: float = 0.5
    """Duration of a slip [s]."""

    def __post_init__(self) -> None:
        require_ranges(self, share=(0.0, 1.0), along_m=(0.0, 0.5), around_rad=(0.0, math.pi), over_s=(0.0, 60.0))

    def apply(self, readings: SimulatedReadings) -> None:
        begin_s, end_s = float(readings.time_s.min()), float(readings.time_s.max())
        for station in readings.stations:
            rng = readings.take_rng("loose", station)
            slips, when, along, around = rng.random() < self.share, rng.random(), rng.normal(), rng.normal()
            if slips:
                MountSlip(
                    station,
                    from_s=begin_s + when * (end_s - begin_s),
                    over_s=self.over_s,
                    around_rad=self.around_rad * around,
                    along_m=self.along_m * along,
                ).apply(readings)
