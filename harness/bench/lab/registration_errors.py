"""Errors of the registration of a boxing capture without a fault, and the rows that hold them to what is promised."""

from collections.abc import Mapping, Sequence
from math import ceil

import numpy as np

from harness.bench.lab.captures import planted_scenario, station_offset_m
from harness.core import rotations
from harness.core.arrays import Floats
from harness.results.benchmark_statement import BenchmarkStatement, state_verdict
from harness.simulate.components.stationary import Clock, SpeedError
from harness.simulate.simulation import WORLD_FROM_TRACKER
from harness.study.trust.validation import Validation

PROMISES: Mapping[str, tuple[str, float, str]] = {
    "room_m": ("room, amid the motion", 0.002, "mm"),
    "mounts_m": ("worst mount, position", 0.002, "mm"),
    "room_rad": ("room, orientation", float(np.deg2rad(0.5)), "deg"),
    "mounts_rad": ("worst mount, orientation", float(np.deg2rad(0.5)), "deg"),
    "median_rad": ("median orientation of room and mounts", float(np.deg2rad(0.3)), "deg"),
    "offset_s": ("time offset by orientation", 0.0005, "ms"),
    "ahead_s": ("difference of the two time offsets", 0.0006, "ms"),
    "clock_ppm": ("clock ratio", 10.0, "ppm"),
}
"""Key of an error -> its name, its largest value and the unit that it is shown in."""
WANTED = 0.95
"""Share of the captures in which an error has to be within what is promised."""
_PER_UNIT = {"mm": 1e3, "ms": 1e3, "deg": 180.0 / np.pi, "ppm": 1.0}


def registration_errors(found: Validation, seed: int) -> dict[str, float]:
    """Errors of the registration by `PROMISES`, in SI units, of the capture of this seed.

    The true mount is the nominal one and the session's offset in the housing. The room's position is that of the mean
    place of all bodies: the tracker's origin lies far above them.
    """
    registration, truth = found.registration, found.truth
    places = np.concatenate([poses.position_m for poses in truth.bodies.values()])
    amid_m = np.nanmean(places, axis=0)
    origin_m = np.array(planted_scenario("none_validated", seed).tracker.origin_m)
    in_tracker_m = rotations.rotate(rotations.inverse(WORLD_FROM_TRACKER), amid_m - origin_m)
    room_m = np.array([one.value for one in registration.room_point(in_tracker_m)]) - amid_m
    moved_m, turned_rad = [], []
    for station, mount in registration.mounts.items():
        nominal = truth.nominal[station]
        offset_m = rotations.rotate(nominal.body_from_station, station_offset_m(seed, station))
        moved_m.append(float(np.linalg.norm(mount.position_m - nominal.position_m - offset_m)))
        turned_rad.append(_angle_rad(mount.body_from_station, nominal.body_from_station))
    room_rad = _angle_rad(registration.world_from_tracker, WORLD_FROM_TRACKER)
    values = registration.values
    offset_s = 1e-6 * Clock.drift_ppm * registration.reference_s
    return {
        "room_m": float(np.linalg.norm(room_m)),
        "mounts_m": max(moved_m),
        "room_rad": room_rad,
        "mounts_rad": max(turned_rad),
        "median_rad": float(np.median([room_rad, *turned_rad])),
        "offset_s": abs(values["time_offset_orientation_s"].value - offset_s),
        "ahead_s": abs(values["position_ahead_s"].value - SpeedError.ahead_s),
        "clock_ppm": abs(values["clock_ratio_ppm"].value - Clock.drift_ppm),
    }


def registration_rows(errors: Sequence[Mapping[str, float]], captures: int) -> list[BenchmarkStatement]:
    """The row of each promise, over the captures that were registered; others count as missed."""
    rows = []
    for key, (name, most, unit) in PROMISES.items():
        values = np.array([one[key] for one in errors])
        within, needed, scale = int(np.sum(values <= most)), ceil(WANTED * captures - 1e-9), _PER_UNIT[unit]
        note = f"largest {scale * values.max():.2g} {unit}" if len(values) else ""
        held_to = f"within {scale * most:.2g} {unit} in {needed} of {captures}"
        rows.append(state_verdict(f"validate, 1 min, {name}", held_to, f"in {within}", within >= needed, "", note))
    return rows


def _angle_rad(a: Floats, b: Floats) -> float:
    return float(rotations.angle_between_rad(a, b))
