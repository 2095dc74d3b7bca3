"""Mounts, room and bone lengths of a performer, from a T-pose or from calibration poses."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.calibrate.calibration_file import EXPECTED as EXPECTED
    from harness.calibrate.calibration_file import CalibrationFile as CalibrationFile
    from harness.calibrate.calibration_file import CalibrationOutcome as CalibrationOutcome
    from harness.calibrate.calibration_file import read_calibration as read_calibration
    from harness.calibrate.calibration_file import write_calibration as write_calibration
    from harness.calibrate.calibration_report import report_pose_calibration as report_pose_calibration
    from harness.calibrate.calibration_report import report_tpose_calibration as report_tpose_calibration
    from harness.calibrate.guided_calibration import GuidedPose as GuidedPose
    from harness.calibrate.guided_calibration import Notifier as Notifier
    from harness.calibrate.guided_calibration import PoseDisplay as PoseDisplay
    from harness.calibrate.guided_calibration import PoseGuide as PoseGuide
    from harness.calibrate.hold import UnusableHold as UnusableHold
    from harness.calibrate.kim2012_calibration import SensorMaps as SensorMaps
    from harness.calibrate.kim2012_calibration import calibrate_kim2012 as calibrate_kim2012
    from harness.calibrate.liu2011_calibration import calibrate_liu2011 as calibrate_liu2011
    from harness.calibrate.performer_preview import PerformerPose as PerformerPose
    from harness.calibrate.performer_preview import PerformerPreview as PerformerPreview
    from harness.calibrate.pose_calibration import PoseCalibration as PoseCalibration
    from harness.calibrate.pose_calibration import calibrate_poses as calibrate_poses
    from harness.calibrate.pose_classifier import PoseClassifier as PoseClassifier
    from harness.calibrate.pose_collector import HOLD_S as HOLD_S
    from harness.calibrate.pose_collector import PoseCollector as PoseCollector
    from harness.calibrate.poses import POSES as POSES
    from harness.calibrate.poses import CalibrationPose as CalibrationPose
    from harness.calibrate.poses import pose_configuration as pose_configuration
    from harness.calibrate.skeleton_prior import SkeletonPrior as SkeletonPrior
    from harness.calibrate.skeleton_prior import fit_skeleton_prior as fit_skeleton_prior
    from harness.calibrate.tpose_calibration import calibrate_tpose as calibrate_tpose
else:
    __getattr__, __dir__ = lazy_names(__name__)
