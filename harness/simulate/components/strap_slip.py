"""Straps that may slip, whichever stations are worn: for studies in which every set has other stations."""

import math
from dataclasses import dataclass

from harness.simulate.components.mount import MountSlip
from harness.simulate.parameter_ranges import require_ranges
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class StrapSlip:
    """Each strap slips once in a take with probability `share`, at any moment as likely as at any other, by N(0,
    `along_m`) along the bone and N(0, `around_rad`) around it (see `MountSlip`). In no level; all numbers are choices.

    A station draws for itself: it slips alike in every set of stations that has it.
    """

    share: float = 0.2
    """Of the straps."""
    along_m: float = 0.01
    """Standard deviation [m]."""
    around_rad: float = 0.15
    """Standard deviation [rad]."""
    over_s: float = 0.5
    """How long a slip takes [s]."""

    def __post_init__(self) -> None:
        require_ranges(self, share=(0.0, 1.0), along_m=(0.0, 0.5), around_rad=(0.0, math.pi), over_s=(0.0, 60.0))

    def apply(self, sensed: SimulatedReadings) -> None:
        begin_s, end_s = float(sensed.time_s.min()), float(sensed.time_s.max())
        for station in sensed.stations:
            rng = sensed.take_rng("loose", station)
            slips, when, along, around = rng.random() < self.share, rng.random(), rng.normal(), rng.normal()
            if slips:
                MountSlip(
                    station,
                    from_s=begin_s + when * (end_s - begin_s),
                    over_s=self.over_s,
                    around_rad=self.around_rad * around,
                    along_m=self.along_m * along,
                ).apply(sensed)
