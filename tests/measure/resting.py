"""Series of stations at rest with simulated errors, for tests of the estimators."""

from dataclasses import replace

from harness.measure.static_series import StaticSeries, find_rest, static_series
from harness.simulate.noise import Noise, noise_preset
from harness.simulate.readings import SimulatedReadings
from tests.measure.static_readings import simulate_static, station_readings

RATE_HZ = 40.0


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
