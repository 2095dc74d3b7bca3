"""White noise of single records."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats
from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class WhiteNoise:
    """Normal noise, independent for each record and axis: the resolution floor (docs/is900.md 13.5, unverified)."""

    position_m: Annotated[float, Range(0.0, 1.0)] = 0.00075
    """Standard deviation on each axis [m]."""
    orientation_rad: Annotated[float, Range(0.0, 1.0)] = float(np.deg2rad(0.05))
    """Standard deviation about each axis [rad]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        draws = [readings.take_rng("white", s).normal(size=(len(readings.time_s), 6)) for s in readings.stations]
        noise: Floats = np.stack(draws, axis=1)
        readings.move(self.position_m * noise[..., :3])
        readings.rotate(self.orientation_rad * noise[..., 3:])
