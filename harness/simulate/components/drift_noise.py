"""Slow drift of position and orientation."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats
from harness.core.ranges import Range, check_fields
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class DriftNoise:
    """First-order Gauss-Markov error on each axis, stationary from the start.

    The 1.5 mm were measured at rest by Gilson et al. 2006. The angles are the manufacturer's, unverified. A correlation
    time of 0.2 to 2 s is inferred from how ranges correct the inertial solution (docs/is900.md 13.1, 13.2 and 13.5).
    Gravity constrains pitch and roll better than ranges constrain yaw.
    """

    position_m: Annotated[float, Range(0.0, 1.0)] = 0.0015
    """RMS on each axis [m]."""
    pitch_roll_rad: Annotated[float, Range(0.0, 1.0)] = float(np.deg2rad(0.25))
    """RMS about each horizontal axis [rad]."""
    yaw_rad: Annotated[float, Range(0.0, 1.0)] = float(np.deg2rad(0.50))
    """RMS about the vertical axis [rad]."""
    correlation_s: Annotated[float, Range(1e-3, 1e6)] = 1.0
    """Time after which the correlation is 1/e [s]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        draws = [readings.take_rng("slow", s).normal(size=(len(readings.time_s), 6)) for s in readings.stations]
        wander = gauss_markov(np.stack(draws, axis=1), float(np.exp(-1.0 / (readings.rate_hz * self.correlation_s))))
        readings.move(self.position_m * wander[..., :3])
        readings.rotate(np.array([self.pitch_roll_rad, self.pitch_roll_rad, self.yaw_rad]) * wander[..., 3:])


def gauss_markov(white: Floats, correlation: float) -> Floats:
    """Gauss-Markov sequences (N, ...) of unit variance and the given lag-1 correlation, from white noise."""
    out: Floats = white * np.sqrt(1.0 - correlation**2)
    out[:1] = white[:1]
    for previous, row in pairwise(out.reshape(len(out), -1)):
        row += correlation * previous
    return out
