"""Mounts, room and bone lengths of a performer, from a T-pose or from calibration poses."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.calibrate.calibration_file import (
        EXPECTED,
        CalibrationFile,
        CalibrationOutcome,
        read_calibration,
        write_calibration,
    )
    from harness.calibrate.calibration_report import report_pose_calibration, report_tpose_calibration
    from harness.calibrate.guided_calibration import GuidedPose, Notifier, PoseDisplay, PoseGuide
    from harness.calibrate.hold import UnusableHold
    from harness.calibrate.kim2012_calibration import SensorMaps, calibrate_kim2012
    from harness.calibrate.liu2011_calibration import calibrate_liu2011
    from harness.calibrate.performer_preview import PerformerPose, PerformerPreview
    from harness.calibrate.pose_calibration import PoseCalibration, calibrate_poses
    from harness.calibrate.pose_classifier import PoseClassifier
    from harness.calibrate.pose_collector import HOLD_S, PoseCollector
    from harness.calibrate.poses import POSES, CalibrationPose, pose_configuration
    from harness.calibrate.skeleton_prior import SkeletonPrior, fit_skeleton_prior
    from harness.calibrate.tpose_calibration import calibrate_tpose
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "EXPECTED",
    "HOLD_S",
    "POSES",
    "CalibrationFile",
    "CalibrationOutcome",
    "CalibrationPose",
    "GuidedPose",
    "Notifier",
    "PerformerPose",
    "PerformerPreview",
    "PoseCalibration",
    "PoseClassifier",
    "PoseCollector",
    "PoseDisplay",
    "PoseGuide",
    "SensorMaps",
    "SkeletonPrior",
    "UnusableHold",
    "calibrate_kim2012",
    "calibrate_liu2011",
    "calibrate_poses",
    "calibrate_tpose",
    "fit_skeleton_prior",
    "pose_configuration",
    "read_calibration",
    "report_pose_calibration",
    "report_tpose_calibration",
    "write_calibration",
]
