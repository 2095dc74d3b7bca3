"""The verdict of a calibration in words: good, usable or poor, and what to repeat.

It follows from the standard deviations of the mounts and from the errors of the poses. A pose that was missed too far
has no verdict: `pose_checks` refuses it.
"""

import numpy as np

from harness.calibrate.pose_calibration import PoseCalibration
from harness.calibrate.poses import POSES
from harness.calibrate.tpose_calibration import TPoseCalibration

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
    station = int(np.argmax(off_m))
    return (
        f"pose {pose + 1} ({POSES[pose].name}) was missed: {result.calibration.stations[station]} was "
        f"{1e2 * off_m[station]:.0f} cm from its place, hinges {np.rad2deg(result.pose_error_rad[pose]):.1f} deg off"
    )


def _grade(size: float, turn: float, usable: float) -> str:
    """Word for errors in units of what is good."""
    worst = max(size, turn)
    return "good" if worst <= 1.0 else "usable" if worst <= usable else "poor"
