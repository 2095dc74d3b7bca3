"""Errors that every reading has: white, slow, constant for a session, and growing with speed.

Default numbers: docs/is900.md 13.5. None is a measurement of a unit.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from harness.core import rotations
from harness.core.arrays import Floats
from harness.simulate.readings import Draw, Readings, per_station


@dataclass(frozen=True)
class White:
    """Independent from record to record, Gaussian, per axis. From the resolution, which no source verifies."""

    position_m: float = 0.00075
    orientation_deg: float = 0.05

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        noise = per_station(seen, draw, lambda rng: rng.standard_normal((len(seen.time_s), 6)))
        return _moved(seen, self.position_m * noise[..., :3], np.deg2rad(self.orientation_deg) * noise[..., 3:])


@dataclass(frozen=True)
class Slow:
    """Gauss-Markov with the RMS of the static accuracy (position: Gilson et al. 2006; angles: unverified)."""

    position_m: float = 0.0015
    pitch_roll_deg: float = 0.25
    yaw_deg: float = 0.50
    correlation_s: float = 1.0

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        keep = np.exp(-1.0 / (seen.rate_hz * self.correlation_s))
        noise = per_station(seen, draw, lambda rng: gauss_markov(rng, len(seen.time_s), 6, keep))
        turn_deg = np.array([self.pitch_roll_deg, self.pitch_roll_deg, self.yaw_deg])
        return _moved(seen, self.position_m * noise[..., :3], np.deg2rad(turn_deg) * noise[..., 3:])


@dataclass(frozen=True)
class Session:
    """Constant while a session lasts: a scale common to all stations (temperature) and an offset of each."""

    scale: float = 0.001
    """Standard deviation of the relative error of every distance from the tracker's origin."""
    offset_m: float = 0.001
    """Standard deviation per axis."""

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        scale = self.scale * draw("").standard_normal()
        offset = per_station(seen, draw, lambda rng: np.tile(rng.standard_normal(3), (len(seen.time_s), 1)))
        return replace(seen, position_m=(1.0 + scale) * seen.position_m + self.offset_m * offset)


@dataclass(frozen=True)
class SpeedError:
    """Ranges are taken at another moment than the record's (Gilson et al. 2006; size ours)."""

    lead_s: float = 0.002

    def applied(self, seen: Readings, draw: Draw) -> Readings:
        return replace(seen, position_m=seen.position_m + self.lead_s * seen.velocity_m_s)


def gauss_markov(rng: np.random.Generator, count: int, columns: int, keep: float) -> Floats:
    """(count, columns) stationary, unit variance, correlation `keep` from one to the next."""
    white = rng.standard_normal((count, columns))
    white[1:] *= np.sqrt(1.0 - keep * keep)
    out: Floats = lfilter([1.0], [1.0, -keep], white, axis=0)
    return out


def _moved(seen: Readings, by_m: Floats, turned_rad: Floats) -> Readings:
    """Shifted by, and turned about, axes of the tracker frame: x and y are roll and pitch, z is yaw."""
    turned = rotations.multiply(rotations.exp(turned_rad), seen.tracker_from_station)
    return replace(seen, position_m=seen.position_m + by_m, tracker_from_station=turned)
