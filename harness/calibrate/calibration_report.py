"""Reports of a calibration: a table for the file, lines for the screen, and a verdict in words: good, usable or poor.

The verdict follows from the standard deviations of the mounts and from the errors of the poses, and says what to
repeat. A pose that was missed too far has no verdict: `pose_checks` refuses it.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.calibrate.pose_calibration import PoseCalibration
from harness.calibrate.poses import POSES
from harness.calibrate.tpose_calibration import TPoseCalibration
from harness.core.number_format import format_fixed
from harness.core.text_table import Table

CalibrationReport = tuple[dict[str, Any], list[str]]
"""The `[diagnostics]` table of the file, and lines for the screen."""
_MOUNT_FIELDS = ("mount_sd", "mount_bound", "residual")


def report_pose_calibration(result: PoseCalibration) -> CalibrationReport:
    """Report of an eight-pose calibration: a row for each bone and station, the quality of the fit, and hints."""
    names, stations = result.skeleton.names, result.calibration.stations
    lengths = {
        name: {"length_m": length, "sd_m": sd, "mean_m": mean, "bound_m": bound, "known": known, "from_prior": prior}
        for name, length, sd, mean, bound, known, prior in zip(
            names,
            result.skeleton.length_m.tolist(),
            result.length_sd_m.tolist(),
            result.mean_m.tolist(),
            result.length_bound_m.tolist(),
            result.variance_reduction.tolist(),
            result.from_prior.tolist(),
            strict=True,
        )
    }
    deg = {name: np.rad2deg(getattr(result, f"{name}_rad")).tolist() for name in _MOUNT_FIELDS}
    size_m = {name: getattr(result, f"{name}_m").tolist() for name in _MOUNT_FIELDS}
    mounts = {
        station: {
            f"{name}_{unit}": of[name][row] for name in _MOUNT_FIELDS for unit, of in (("m", size_m), ("deg", deg))
        }
        for row, station in enumerate(stations)
    }
    names_of_poses = [POSES[number].name for number in result.pose_numbers]
    miss_deg = dict(zip(names_of_poses, np.rad2deg(result.pose_error_rad).tolist(), strict=True))
    diagnostics = {
        "seconds": result.seconds,
        "miss_deg": float(np.rad2deg(result.hinge_error_rad)),
        "beside": result.mount_spread,
        "condition": result.condition,
        "hints": list(result.hints),
        "verdict": (verdict := pose_verdict(result)),
        "miss_deg_of_pose": miss_deg,
        "stations": {name: _finite(row) for name, row in mounts.items()},
        "bones": {name: _finite(row) for name, row in lengths.items()},
    }
    lines = [*_bone_lines(lengths), "", *_mount_lines(mounts), "", *_fit_lines(result, miss_deg)]
    return diagnostics, [*lines, "", verdict]


def _bone_lines(lengths: Mapping[str, Mapping[str, Any]]) -> list[str]:
    head = ["bone [mm]", "estimate", "sd", "mean skeleton", "bound alone", "from trackers", ""]
    rows = [
        [
            *(name, f"{1e3 * row['length_m']:.1f}", f"{1e3 * row['sd_m']:.1f}", f"{1e3 * row['mean_m']:.1f}"),
            *(_mm(row["bound_m"]), f"{row['known']:.0%}", "from the prior" if row["from_prior"] else ""),
        ]
        for name, row in lengths.items()
    ]
    return Table(head, rows).lines()


def _mount_lines(mounts: Mapping[str, Mapping[str, float]]) -> list[str]:
    head = ["mount", "sd [mm]", "[deg]", "bound alone [mm]", "[deg]", "residual [mm]", "[deg]"]
    rows = [
        [
            name,
            *(word for key in _MOUNT_FIELDS for word in (_mm(row[f"{key}_m"]), f"{row[f'{key}_deg']:.2f}")),
        ]
        for name, row in mounts.items()
    ]
    return Table(head, rows).lines()


def _fit_lines(result: PoseCalibration, miss_deg: Mapping[str, float]) -> list[str]:
    worst = max(miss_deg, key=lambda name: miss_deg[name])
    return [
        "bound alone: the Cramér-Rao bound without a prior of people's bones and of the mounts",
        f"hinges are off the poses by {np.rad2deg(result.hinge_error_rad):.1f} deg, "
        f"{worst!r} by {miss_deg[worst]:.1f} deg",
        f"trackers sit {result.mount_spread:.1f} times as far from their mounts as is usual",
        f"condition number {result.condition:.3g}; {len(miss_deg)} poses held for {result.seconds:.1f} s in all",
        *(f"hint: {hint}" for hint in result.hints),
    ]


def report_tpose_calibration(result: TPoseCalibration) -> CalibrationReport:
    """Report of a T-pose calibration: a row for each station, and the uncertainty of the heading."""
    names = result.calibration.stations
    stations = {
        name: {"residual_m": residual_m, "moved_m": moved_m}
        for name, residual_m, moved_m in zip(names, result.residual_m.tolist(), result.moved_m.tolist(), strict=True)
    }
    rows = [[name, _mm(row["residual_m"]), _mm(row["moved_m"])] for name, row in stations.items()]
    heading_deg = float(np.rad2deg(result.heading_sd_rad))
    lines = [
        *Table(["station", "off the T-pose [mm]", "moved [mm]"], rows).lines(),
        f"standard deviation of the heading {heading_deg:.1f} deg; T-pose held for {result.seconds:.1f} s",
        "",
        verdict := tpose_verdict(result),
    ]
    diagnostics = {"seconds": result.seconds, "heading_sd_deg": heading_deg, "verdict": verdict, "stations": stations}
    return diagnostics, lines


def _mm(length_m: float) -> str:
    return format_fixed(1e3 * length_m, 1) if np.isfinite(length_m) else "none"


def _finite(row: Mapping[str, Any]) -> dict[str, Any]:
    """The row without infinite values, which TOML readers and JSON do not share."""
    return {name: value for name, value in row.items() if np.isfinite(value)}


GOOD_M, GOOD_RAD = 0.015, float(np.deg2rad(3.0))
"""Largest standard deviations of a mount that are called good [m, rad] [choice]: those of a performer who misses the
poses by 2.5 deg (docs/notes/calibration.md) are 10 mm and 1.5 deg."""
USABLE_M, USABLE_RAD = 0.03, float(np.deg2rad(6.0))
"""Largest standard deviations that are called usable: twice the good ones [m, rad] [choice]."""
REPEAT_RATIO, REPEAT_RAD = 1.5, float(np.deg2rad(3.0))
"""A pose should be repeated if its error exceeds the median pose's by this ratio and exceeds this angle [choice]."""
GOOD_DISTANCE_M = 0.1
"""Largest distance of a station from the T-pose that is called good [m] [choice]: 6 deg over an arm and 3 cm of strap
are 8 cm."""


def pose_verdict(result: PoseCalibration) -> str:
    """Verdict on eight poses, such as "good: every station's mount is known to 9 mm and 1.4 deg"."""
    size_m, turn_rad = float(result.mount_sd_m.max()), float(result.mount_sd_rad.max())
    word = _grade(size_m / GOOD_M, turn_rad / GOOD_RAD, USABLE_M / GOOD_M)
    text = f"{word}: every station's mount is known to {1e3 * size_m:.0f} mm and {np.rad2deg(turn_rad):.1f} deg"
    advice = [_missed_text(result, pose) for pose in poses_to_repeat(result)]
    if word != "good" and not advice:
        advice = ["hold the poses more exactly"]
    return "; ".join([f"{text} (standard deviation)", *advice])


def poses_to_repeat(result: PoseCalibration) -> list[int]:
    """Indices of the poses that stand out, the worst first."""
    error = result.pose_error_rad
    limit = max(REPEAT_RATIO * float(np.median(error)), REPEAT_RAD)
    return [int(pose) for pose in np.argsort(-error, kind="stable") if error[pose] > limit]


def tpose_verdict(result: TPoseCalibration) -> str:
    """Verdict on a T-pose: how far the stations are from it, and how well it determines the heading."""
    far = int(np.argmax(result.residual_m))
    word = _grade(float(result.residual_m[far]) / GOOD_DISTANCE_M, 0.0, 2.0)
    name = result.calibration.stations[far]
    text = (
        f"{word} T-pose: {name} is {1e2 * result.residual_m[far]:.0f} cm from its place, the others less; the "
        f"heading is known to {np.rad2deg(result.heading_sd_rad):.1f} deg (standard deviation)"
    )
    return text if word == "good" else f"{text}; hold the T-pose again, or calibrate from eight poses"


def _missed_text(result: PoseCalibration, pose: int) -> str:
    off_m = result.pose_distance_m[pose]
    station, number = int(np.argmax(off_m)), result.pose_numbers[pose]
    return (
        f"pose {number + 1} ({POSES[number].name}) was missed: {result.calibration.stations[station]} was "
        f"{1e2 * off_m[station]:.0f} cm from its place, hinges {np.rad2deg(result.pose_error_rad[pose]):.1f} deg off"
    )


def _grade(size: float, turn: float, usable: float) -> str:
    """Word for errors in units of what is good."""
    worst = max(size, turn)
    return "good" if worst <= 1.0 else "usable" if worst <= usable else "poor"
