"""Errors that every reading has: white noise, drift, session bias, speed error and the error of the clock."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.ranges import CheckedFields, Range
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class WhiteNoise(CheckedFields):
    """Normal noise, independent for each record and axis: the resolution floor (docs/is900.md 13.5, unverified)."""

    position_m: Annotated[float, Range(0.0, 1.0)] = 0.00075
    """Standard deviation on each axis [m]."""
    orientation_rad: Annotated[float, Range(0.0, 1.0)] = float(np.deg2rad(0.05))
    """Standard deviation about each axis [rad]."""

    def apply(self, readings: SimulatedReadings) -> None:
        draws = [readings.take_rng("white", s).normal(size=(len(readings.time_s), 6)) for s in readings.stations]
        noise: Floats = np.stack(draws, axis=1)
        readings.translate(self.position_m * noise[..., :3])
        readings.rotate(self.orientation_rad * noise[..., 3:])


@dataclass(frozen=True)
class DriftNoise(CheckedFields):
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

    def apply(self, readings: SimulatedReadings) -> None:
        draws = [readings.take_rng("slow", s).normal(size=(len(readings.time_s), 6)) for s in readings.stations]
        wander = gauss_markov(np.stack(draws, axis=1), float(np.exp(-1.0 / (readings.rate_hz * self.correlation_s))))
        readings.translate(self.position_m * wander[..., :3])
        readings.rotate(np.array([self.pitch_roll_rad, self.pitch_roll_rad, self.yaw_rad]) * wander[..., 3:])


def gauss_markov(white: Floats, correlation: float) -> Floats:
    """Gauss-Markov sequences (N, ...) of unit variance and the given correlation of neighbours, from white noise."""
    out: Floats = white * np.sqrt(1.0 - correlation**2)
    out[:1] = white[:1]
    for previous, row in pairwise(out.reshape(len(out), -1)):
        row += correlation * previous
    return out


@dataclass(frozen=True)
class SessionBias(CheckedFields):
    """Scale error of all positions, by temperature (0.17 % per deg C), and offset of each station in its housing.

    Both are normal and drawn once per session (docs/is900.md 13.3 and 13.5; the sizes are inferred).
    """

    scale: Annotated[float, Range(0.0, 0.1)] = 1e-3
    """Standard deviation of the scale error about the tracker's origin, common to all stations."""
    station_offset_m: Annotated[float, Range(0.0, 1.0)] = 1e-3
    """Standard deviation of the offset on each axis of a station [m]."""

    def apply(self, readings: SimulatedReadings) -> None:
        for row, station in enumerate(readings.stations):
            offset_m = self.station_offset_m * readings.session_rng("session", station).normal(size=3)
            readings.position_m[:, row] += rotations.rotate(readings.turn[:, row], offset_m)
        readings.position_m *= 1.0 + self.scale * readings.session_rng("session", "").normal()


@dataclass(frozen=True)
class SpeedError(CheckedFields):
    """A timing error: ranges are measured at another moment than the record states.

    Gilson et al. 2006 found errors that grow with speed; the size is inferred (docs/is900.md 13.3 and 13.5).
    """

    ahead_s: Annotated[float, Range(-1.0, 1.0)] = 0.002
    """Time by which positions run ahead of the record's time stamp [s]; negative lags."""

    def apply(self, readings: SimulatedReadings) -> None:
        readings.translate(self.ahead_s * readings.velocity_m_s)


@dataclass(frozen=True)
class Clock(CheckedFields):
    """Offset and constant drift of the device's clock against true time (docs/is900.md 13.5).

    Rounding to 32-bit milliseconds is part of the wire format and happens with every noise preset.
    """

    offset_s: Annotated[float, Range(0.0, 1e6)] = 0.0
    """Reading of the clock at the beginning of the take [s]."""
    drift_ppm: Annotated[float, Range(-1e5, 1e5)] = 20.0
    """Rate error; positive runs faster [1e-6]."""

    def apply(self, readings: SimulatedReadings) -> None:
        readings.device_s = self.offset_s + (1.0 + 1e-6 * self.drift_ppm) * readings.time_s
