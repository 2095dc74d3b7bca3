"""Stations at rest with planted errors, for tests."""

import numpy as np

from harness.measure.static_series import StaticSeries
from harness.simulate.components.stationary import DriftNoise, WhiteNoise
from harness.simulate.noise import Noise
from harness.simulate.readings import SimulatedReadings

QUIET = Noise(white=WhiteNoise(), drift=DriftNoise())


def at_rest(
    noise: Noise, seed: int, *, seconds: float = 120.0, rate_hz: float = 40.0, stations: tuple[str, ...] = ("chest",)
) -> list[StaticSeries]:
    """The series of stations that rest at the origin, with the errors of `noise`."""
    count, number = round(seconds * rate_hz), len(stations)
    time_s = np.repeat(np.arange(count)[:, None] / rate_hz, number, axis=1)
    nothing = np.zeros((count, number, 3))
    readings = SimulatedReadings(
        seed=seed,
        take="rest",
        stations=stations,
        time_s=time_s,
        rate_hz=rate_hz,
        velocity_m_s=nothing,
        radius_m=np.zeros(number),
        tissue_m=np.zeros(number),
        force_m_s2=nothing,
        position_m=nothing.copy(),
        turn=np.tile([1.0, 0.0, 0.0, 0.0], (count, number, 1)),
        quality=np.ones((count, number)),
        device_s=time_s.copy(),
    )
    noise.apply(readings)
    return [
        planted_series(readings.position_m[:, row], np.round(readings.quality[:, row] * 255.0) / 255.0, rate_hz, name)
        for row, name in enumerate(stations)
    ]


def planted_series(
    position_m: np.ndarray, quality: np.ndarray, rate_hz: float = 40.0, station: str = "chest"
) -> StaticSeries:
    """A series of these positions (N, 3) and qualities (N,); quality 0 is not valid."""
    valid = quality > 0.0
    place_m = np.where(valid[:, None], position_m, np.nan)
    place_m -= np.nanmedian(place_m, axis=0)
    return StaticSeries(station, rate_hz, 0.0, 0.0, place_m, np.zeros_like(place_m), quality, valid)
