"""White noise of single records."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.simulate.sensed import Sensed


@dataclass(frozen=True)
class White:
    """Independent from record to record, normal on each axis: the resolution floor (PROTOCOL 13.5, unverified)."""

    position_m: float = 0.00075
    """Standard deviation on each axis [m]."""
    orientation_rad: float = float(np.deg2rad(0.05))
    """Standard deviation about each axis [rad]."""

    def spoil(self, sensed: Sensed) -> None:
        draws = [sensed.draw("white", s).normal(size=(len(sensed.time_s), 6)) for s in sensed.stations]
        noise: Floats = np.stack(draws, axis=1)
        sensed.move(self.position_m * noise[..., :3])
        sensed.rotate(self.orientation_rad * noise[..., 3:])
