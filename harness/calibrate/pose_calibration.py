"""Calibration of skeleton and mounts from eight poses (Liu et al. 2011, eq. 1; docs/methods.md A3, H15).

What differs from eq. 1: residuals are weighed by how far device, mounts, bones and performers go astray, in place of
alpha_1 and alpha_2; joint angles are not taken as known but estimated too, as misses of the poses shown; where the
performer stands and faces in each pose is free; bones may point elsewhere than the mean skeleton's where people's do.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import ground, kinematics
from harness.body.mounts import Mount
from harness.calibrate import pose_checks, station_orientation
from harness.calibrate.bundle_adjustment import BundleAdjustment
from harness.calibrate.bundle_fit import BundleFit, fit_bundle
from harness.calibrate.hold import HoldReadings, measure_hold
from harness.calibrate.poses import POSES, pose_angles_rad
from harness.calibrate.skeleton_prior import SkeletonPrior
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.calibrate.uncertainty import CalibrationUncertainty, estimate_uncertainty
from harness.calibrate.unknowns import SharedUnknowns
from harness.core import humanoid24, rotations
from harness.core.arrays import Bools, Floats, freeze
from harness.core.calibration import Calibration
from harness.core.skeleton import Skeleton
from harness.errors import BadInput
from harness.stream.frame import TrackerFrame

FLOOR_M, FLOOR_RAD = 5e-5, float(np.deg2rad(0.005))
"""No typical reading is better than this [choice]; what the readings of each hold scatter comes on top."""
LEAST_VARIANCE_REDUCTION = 0.9
"""A length is called "from the prior" unless the trackers take away this share of its variance among people."""
_SD_PER_QUARTILE = 1.0 / 2.027
"""Three quarters of normal readings lie within 2.027 standard deviations of an axis of their mean (chi, 3 degrees)."""


@dataclass(frozen=True, eq=False)
class PoseCalibration:
    """What eight poses told; N bones, S stations."""

    calibration: Calibration
    """Of kind `poses`."""
    skeleton: Skeleton
    mean_m: Floats
    """(N,) bone lengths of the mean skeleton."""
    length_sd_m: Floats
    """(N,) standard deviation of the lengths found: the Cramér-Rao bound with what is known of people's bones."""
    length_bound_m: Floats
    """(N,) the bound without it, for whoever is unbiased; infinite where trackers do not tell."""
    variance_reduction: Floats
    """(N,) share of the variance among people that the trackers take away; nominal mounts do not count."""
    from_prior: Bools
    """(N,) lengths of which they take away too little."""
    mount_sd_m: Floats
    """(S,) standard deviation of the mounts found, all axes together."""
    mount_sd_rad: Floats
    """(S,)"""
    mount_bound_m: Floats
    """(S,) the bound without anything known of bones and mounts."""
    mount_bound_rad: Floats
    """(S,)"""
    residual_m: Floats
    """(S,) root mean square over the poses of what is left."""
    residual_rad: Floats
    """(S,)"""
    hinge_error_rad: float
    """How far the performer missed the poses, standard deviation of a hinge."""
    pose_error_rad: Floats
    """(P,) likewise of each pose."""
    mount_spread: float
    """How far trackers sit from their nominal mounts, in units of `unknowns.ALONG_M` and `ACROSS_M`."""
    condition: float
    """Of the whitened normal matrix: the best known combination against the least known one."""
    hints: tuple[str, ...]
    seconds: float
    """How long poses were held, all together."""

    def __post_init__(self) -> None:
        bones, stations = self.skeleton.bone_count, len(self.calibration.stations)
        freeze(self, mean_m=(bones,), length_sd_m=(bones,), length_bound_m=(bones,), variance_reduction=(bones,))
        freeze(self, np.bool_, from_prior=(bones,))
        freeze(self, mount_sd_m=(stations,), mount_sd_rad=(stations,), residual_m=(stations,), residual_rad=(stations,))
        freeze(self, mount_bound_m=(stations,), mount_bound_rad=(stations,), pose_error_rad=("P",))


def calibrate_poses(
    held: Sequence[Sequence[TrackerFrame]], space: SkeletonPrior, mounts: Sequence[Mount]
) -> PoseCalibration:
    """Skeleton, mounts and room from the frames of each of the eight holds, in the order of `poses.POSES`.

    `mounts` are in the order of the stream's stations: about where trackers sit, in any orientation. UnusableHold names
    the pose and the station and says what to do; BadInput for a wrong number of poses or stations.
    """
    if len(held) != len(POSES):
        raise BadInput(
            f"{len(held)} poses were held, and {len(POSES)} are asked for.",
            f"Hold these, one after another: {', '.join(pose.name for pose in POSES)}.",
        )
    names = [mount.station for mount in mounts]
    still = [measure_hold(rows, names, pose.name) for rows, pose in zip(held, POSES, strict=True)]
    like = humanoid24.standard_skeleton()
    nominal_rad = np.array([pose_angles_rad(pose, like) for pose in POSES])
    turn = rotations.multiply(LEVEL_FROM_TRACKER, np.array([one.tracker_from_station for one in still]))
    place_m = rotations.rotate(LEVEL_FROM_TRACKER, np.array([one.position_m for one in still]))
    bundle = BundleAdjustment(SharedUnknowns(like, space, mounts), nominal_rad, place_m, rotations.to_matrix(turn))
    pose_checks.require_no_boresight(bundle)
    found = fit_bundle(bundle, *_reading_sd(still))
    pose_checks.require_poses_held(bundle, found)
    return _assemble(bundle, found, estimate_uncertainty(bundle, found), sum(one.seconds for one in still))


def _reading_sd(still: Sequence[HoldReadings]) -> tuple[float, float]:
    """Standard deviations of typical places [m] and orientations [rad] on an axis, from how readings scatter in a hold.

    The device's errors wander over a second, so that a typical reading of a few is hardly better than any one.
    """
    moved_m = float(np.median([one.moved_m for one in still])) * _SD_PER_QUARTILE
    turned_rad = float(np.median([one.turned_rad for one in still])) * _SD_PER_QUARTILE
    return float(np.hypot(FLOOR_M, moved_m)), float(np.hypot(FLOOR_RAD, turned_rad))


def _assemble(
    bundle: BundleAdjustment, found: BundleFit, uncertainty: CalibrationUncertainty, seconds: float
) -> PoseCalibration:
    at, mounts = found.solution, bundle.shared.mounts
    skeleton = bundle.shared.template.with_bones(at.bone_m)
    bone_from_station = rotations.from_matrix(at.bone_from_station)
    world_from_level, shift_m = _world_from_level(skeleton, found)
    off_m, off_rad = bundle.residuals(bundle.forward_kinematics(at))
    return PoseCalibration(
        calibration=Calibration(
            kind="poses",
            stations=tuple(mount.station for mount in mounts),
            bones=tuple(mount.bone for mount in mounts),
            mount_m=at.mount_m,
            bone_from_station=bone_from_station,
            world_from_tracker=rotations.multiply(world_from_level, LEVEL_FROM_TRACKER),
            tracker_origin_m=shift_m,
        ),
        skeleton=skeleton,
        mean_m=bundle.shared.space.mean_m,
        length_sd_m=uncertainty.length_sd_m,
        length_bound_m=uncertainty.length_bound_m,
        variance_reduction=uncertainty.variance_reduction,
        from_prior=uncertainty.variance_reduction < LEAST_VARIANCE_REDUCTION,
        mount_sd_m=uncertainty.mount_sd_m,
        mount_sd_rad=uncertainty.mount_sd_rad,
        mount_bound_m=uncertainty.mount_bound_m,
        mount_bound_rad=uncertainty.mount_bound_rad,
        residual_m=np.sqrt(np.mean(np.sum(off_m**2, axis=2), axis=0)),
        residual_rad=np.sqrt(np.mean(np.sum(off_rad**2, axis=2), axis=0)),
        hinge_error_rad=found.scales.pose_error_rad,
        pose_error_rad=found.pose_error_rad,
        mount_spread=found.scales.mount_spread,
        condition=uncertainty.condition,
        hints=station_orientation.strap_hints(skeleton, mounts, bone_from_station),
        seconds=seconds,
    )


def _world_from_level(skeleton: Skeleton, found: BundleFit) -> tuple[Floats, Floats]:
    """World from level axes: turn (4,) and shift (3,) by which the first pose stands at the origin and faces x. Every
    pose has its lower sole on the floor; the floor is where half of them stand higher."""
    at = found.solution
    root = rotations.from_matrix(at.world_from_root)
    qpos = humanoid24.pack(at.root_m, root, at.angles_rad)
    soles_m = np.min(ground.sole_heights_m(skeleton, kinematics.pose_from_qpos(skeleton, qpos)), axis=1)
    turn = rotations.about_z(-float(rotations.yaw_rad(root[0])))
    origin_m = np.array([*at.root_m[0, :2], np.median(soles_m)])
    return turn, -rotations.rotate(turn, origin_m)
