"""Simulated readings of stations that rest, with the masks of the components that changed them, for tests."""

import numpy as np

from harness.core import rotations
from harness.simulate.noise import Noise
from harness.simulate.readings import SimulatedReadings
from harness.stream.recording.station_readings import StationReadings

STATIONS = ("one", "two", "three", "four", "five", "six")


def simulate_static(
    noise: Noise, seed: int, *, rate_hz: float = 40.0, seconds: float = 300.0, stations: tuple[str, ...] = STATIONS
) -> SimulatedReadings:
    """Readings of stations that rest in different places and attitudes, with the errors of `noise`."""
    count, number = round(seconds * rate_hz), len(stations)
    time_s = np.arange(count)[:, None] / rate_hz + np.arange(number) / (rate_hz * number)
    turn = rotations.exp(np.stack([np.arange(number), 0.3 * np.ones(number), -0.5 * np.arange(number)], axis=1))
    readings = SimulatedReadings(
        seed=seed,
        take="static",
        stations=stations,
        time_s=time_s,
        rate_hz=rate_hz,
        velocity_m_s=np.zeros((count, number, 3)),
        radius_m=np.full(number, 0.05),
        tissue_m=np.full(number, 0.01),
        force_m_s2=np.zeros((count, number, 3)),
        position_m=np.broadcast_to(np.arange(3.0 * number).reshape(number, 3), (count, number, 3)).copy(),
        turn=np.broadcast_to(turn, (count, number, 4)).copy(),
        quality=np.ones((count, number)),
        device_s=time_s.copy(),
    )
    noise.apply(readings)
    return readings


def station_readings(readings: SimulatedReadings, row: int) -> StationReadings:
    """The records of one station; the host receives each at once."""
    lost = readings.quality[:, row : row + 1] == 0.0
    return StationReadings(
        received_s=readings.time_s[:, row],
        measured_s=readings.device_s[:, row],
        stamp_s=readings.device_s[:, row],
        position_m=np.where(lost, np.nan, readings.position_m[:, row]),
        tracker_from_station=np.where(lost, np.nan, readings.turn[:, row]),
        quality=readings.quality[:, row],
        suspect=np.zeros(len(readings.time_s), bool),
    )
