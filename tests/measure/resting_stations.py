"""Stations at rest for tests: with the errors of the simulator, or with planted ones."""

from dataclasses import replace

import numpy as np

from harness.core import rotations
from harness.measure.static_series import StaticSeries, find_rest, static_series
from harness.simulate import DriftNoise, Noise, SimulatedReadings, WhiteNoise, noise_preset
from harness.stream.recording import StationReadings

QUIET = Noise(white=WhiteNoise(), drift=DriftNoise())
STATIONS = ("one", "two", "three", "four", "five", "six")
RATE_HZ = 40.0


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


def default_noise(**changes: object) -> Noise:
    """The preset `default` with some components replaced, without the clock, whose ratio moves the grid."""
    return replace(noise_preset("default"), **{"clock": None, **changes})  # type: ignore[arg-type]  # any component


def rest_series(readings: SimulatedReadings) -> list[StaticSeries]:
    """One series for each rest of each station."""
    out: list[StaticSeries] = []
    for row, station in enumerate(readings.stations):
        records = station_readings(readings, row)
        rests = find_rest(records, readings.rate_hz).tolist()
        out += [static_series(records, (first, end), readings.rate_hz, station) for first, end in rests]
    return out


def simulate_rest(noise: Noise, seed: int, seconds: float, stations: int = 6) -> list[StaticSeries]:
    """Series at rest with these errors."""
    names = tuple(f"s{number}" for number in range(stations))
    return rest_series(simulate_static(noise, seed, rate_hz=RATE_HZ, seconds=seconds, stations=names))
