"""Reports of a calibration: a table for the calibration file and lines for the screen."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.calibrate.calibration_verdict import pose_verdict, tpose_verdict
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
    miss_deg = {pose.name: deg for pose, deg in zip(POSES, np.rad2deg(result.pose_error_rad).tolist(), strict=True)}
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
        f"condition number {result.condition:.3g}; poses held for {result.seconds:.1f} s in all",
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
