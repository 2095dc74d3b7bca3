"""Rows of orientation: tilt, yaw and white part of a free station in two rooms, beside the published figures.

A figure is the root mean square over all seeds, as the published ones are. Pitch and roll are the errors about the two
horizontal axes of the room. The white part is the standard deviation of differences between successive errors, over the
root of two: slow errors cancel in it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from harness.bench.limits import state_verdict
from harness.bench.physics.scenes import StationErrors, free_source, rest_source, track_free_station
from harness.core.arrays import Floats
from harness.results.findings import BenchmarkStatement
from harness.simulate.physics import Physics

ROOMS = "cave", "hall"
TILT_DEG, YAW_DEG = 0.25, 0.50
"""Published static accuracy of pitch and roll, and of yaw, root mean squares [deg] (docs/is900.md 13.1)."""
WHITE_DEG, WHITE_MM = 0.05, 0.75
"""Published resolution [deg], [mm] (docs/is900.md 13.1)."""
BAND = 0.7, 1.3
"""Least and largest figure, in units of the published one. In motion that one is a guide: it was published for rest."""
_SECONDS, _SPEED_M_S = 60.0, 0.5


def orientation_rows(seeds: Sequence[int]) -> Iterator[BenchmarkStatement]:
    """Rows of every room, at rest and in motion, each over all seeds."""
    for room in ROOMS:
        physics = Physics()
        physics = replace(physics, constellation=replace(physics.constellation, name=room))
        yield from room_rows(physics, seeds)


def room_rows(physics: Physics, seeds: Sequence[int]) -> list[BenchmarkStatement]:
    """The rows of one constellation."""
    rest = [track_free_station(lambda: rest_source(_SECONDS, physics), _SECONDS, physics, seed) for seed in seeds]
    moving = [_free(physics, seed) for seed in seeds]
    at_rest, in_motion = (f"{physics.constellation.name}, {how}" for how in ("at rest", f"{_SPEED_M_S:g} m/s"))
    return [
        _row(f"{at_rest}: pitch and roll", [_tilt_deg(errors) for errors in rest], TILT_DEG, "deg"),
        _row(f"{at_rest}: yaw", [_yaw_deg(errors) for errors in rest], YAW_DEG, "deg"),
        _row(f"{in_motion}: pitch and roll", [_tilt_deg(errors) for errors in moving], TILT_DEG, "deg"),
        _row(f"{in_motion}: yaw", [_yaw_deg(errors) for errors in moving], YAW_DEG, "deg"),
        _row(f"{at_rest}: white part", [_white_deg(errors) for errors in rest], WHITE_DEG, "deg"),
        _row(f"{at_rest}: white part of the 3-D position", [_white_mm(errors) for errors in rest], WHITE_MM, "mm"),
    ]


def _free(physics: Physics, seed: int) -> StationErrors:
    return track_free_station(lambda: free_source(seed, _SECONDS, _SPEED_M_S, physics), _SECONDS, physics, seed)


def _tilt_deg(errors: StationErrors) -> float:
    return float(np.rad2deg(_rms(errors.turn_rad[errors.quality > 0.0, :2])))


def _yaw_deg(errors: StationErrors) -> float:
    return float(np.rad2deg(_rms(errors.turn_rad[errors.quality > 0.0, 2])))


def _white_deg(errors: StationErrors) -> float:
    return float(np.rad2deg(_white(errors.turn_rad, errors)))


def _white_mm(errors: StationErrors) -> float:
    return 1e3 * float(np.sqrt(3.0)) * _white(errors.error_m, errors)


def _white(error: Floats, errors: StationErrors) -> float:
    """White part of errors (E, 3), root mean square of the axes, where both of two successive records are tracked."""
    tracked = errors.quality > 0.0
    return _rms(np.diff(error, axis=0)[tracked[1:] & tracked[:-1]]) / float(np.sqrt(2.0))


def _rms(values: Floats | list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _row(name: str, by_seed: list[float], published: float, unit: str) -> BenchmarkStatement:
    value, (low, high) = _rms(by_seed), (published * share for share in BAND)
    target, measured = (
        f"{low:.3g} to {high:.3g} {unit}",
        f"{value:.3f} {unit}, {min(by_seed):.3f} to {max(by_seed):.3f}",
    )
    met = bool(low <= value <= high)
    return state_verdict(name, target, measured, met, f"{published:g} {unit} RMS at rest (docs/is900.md 13.1)")
