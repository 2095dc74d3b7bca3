"""Validation of planted captures against their true motion, as `harness validate CAPTURE --truth CLIP` does it.

Errors of the registration of a capture without a fault are held to what is promised.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from harness.bench.lab.captures import (
    EARLIER,
    needed_captures,
    planted_capture,
    planted_motion,
    planted_scenario,
    station_offset_m,
)
from harness.bench.limits import state_verdict
from harness.body import bone_poses, retarget_to_own_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.measure import TruthPoses
from harness.results.findings import BenchmarkStatement
from harness.simulate import WORLD_FROM_TRACKER, Clock, SpeedError, exact_calibration
from harness.stream.recording import CaptureReader
from harness.study.trust.capture_readings import read_capture
from harness.study.trust.truth_motion import TruthMotion, nominal_mounts
from harness.study.trust.validation import Validation, session_unit, validate_capture

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
_PER_UNIT = {"mm": 1e3, "ms": 1e3, "deg": 180.0 / np.pi, "ppm": 1.0}


def validate_planted(kind: str, seed: int, folder: Path) -> Validation:
    """Record a planted capture and validate it; a scale is compared with an earlier capture of the session."""
    expected = None
    if kind == "scale":
        earlier = read_capture(CaptureReader(planted_capture(EARLIER, seed, folder)))
        expected = session_unit(validate_capture(earlier, planted_truth(EARLIER, seed)), None, EARLIER)
    capture = read_capture(CaptureReader(planted_capture(kind, seed, folder)))
    return validate_capture(capture, planted_truth(kind, seed), expected=expected)


def planted_truth(kind: str, seed: int) -> TruthMotion:
    """The reference of a capture: the performer's bones, with stations where the scenario without a fault has them."""
    scenario, clip = planted_scenario(EARLIER, seed), planted_motion(kind, seed)
    body, take = retarget_to_own_body(clip)
    calibration = exact_calibration(body, scenario.nominal_mounts, scenario.device)
    position_m, world_from_bone = bone_poses(body.skeleton, take.qpos)
    time_s, rows = np.arange(len(take)) / take.rate_hz, {bone: body.skeleton.index(bone) for bone in calibration.bones}
    return TruthMotion(
        f"clip {clip.name}, {time_s[-1]:.1f} s",
        {bone: TruthPoses(time_s, position_m[:, row], world_from_bone[:, row]) for bone, row in rows.items()},
        dict(zip(calibration.stations, calibration.bones, strict=True)),
        nominal_mounts(calibration, calibration.stations),
        host_clock=True,
    )


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
        within, needed, scale = int(np.sum(values <= most)), needed_captures(captures), _PER_UNIT[unit]
        note = f"largest {scale * values.max():.2g} {unit}" if len(values) else ""
        held_to = f"within {scale * most:.2g} {unit} in {needed} of {captures}"
        rows.append(state_verdict(f"validate, 1 min, {name}", held_to, f"in {within}", within >= needed, "", note))
    return rows


def _angle_rad(a: Floats, b: Floats) -> float:
    return float(rotations.angle_between_rad(a, b))
