"""Calibration of skeleton and mounts from eight poses (Liu et al. 2011, eq. 1; docs/papers.md A3; docs/calibration.md).

Differences from eq. 1:

- Residuals are weighted by the spread of device errors, mounts, bones and poses, in place of alpha_1 and alpha_2.
- Joint angles are not taken as known. They are estimated, with the poses as shown as their prior.
- The performer's position and heading are free in each pose.
- Bones may point elsewhere than the mean skeleton's, as far as people's bones differ.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import Mount, pose_from_qpos, sole_heights_m
from harness.calibrate import pose_checks
from harness.calibrate.bundle_adjustment import BundleAdjustment
from harness.calibrate.bundle_fit import BundleFit, CalibrationUncertainty, estimate_uncertainty, fit_bundle
from harness.calibrate.hold import HoldReadings, UnusableHold, measure_hold
from harness.calibrate.poses import POSES, pose_angles_rad
from harness.calibrate.skeleton_prior import SkeletonPrior
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.calibrate.unknowns import CalibrationSolution, SharedUnknowns
from harness.core import humanoid24, rotations
from harness.core.arrays import Bools, Floats, freeze
from harness.core.calibration import Calibration
from harness.core.skeleton import Skeleton
from harness.errors import BadInput
from harness.stream import TrackerFrame

FLOOR_M, FLOOR_RAD = 5e-5, float(np.deg2rad(0.005))
"""Smallest standard deviation of a median reading [m, rad] [choice]; the scatter of each hold is added to it."""
LEAST_POSES = 5
"""Fewest poses of a calibration [choice]. The first is always among them."""
LEAST_VARIANCE_REDUCTION = 0.9
"""A length is called "from the prior" unless the trackers reduce its variance among people by this share."""
_SD_PER_QUARTILE = 1.0 / 2.027
"""Three quarters of normal readings lie within 2.027 standard deviations of an axis of their mean (chi, 3 degrees)."""


@dataclass(frozen=True, eq=False)
class PoseCalibration(CalibrationUncertainty):
    """Result of an eight-pose calibration with its uncertainty; N bones, S stations, P poses."""

    calibration: Calibration
    """Mounts and room, of kind `poses`."""
    skeleton: Skeleton
    """The performer's skeleton, with the standard body's hinges."""
    mean_m: Floats
    """(N,) bone lengths of the mean skeleton [m]."""
    from_prior: Bools
    """(N,) True where `variance_reduction` is below `LEAST_VARIANCE_REDUCTION`."""
    residual_m: Floats
    """(S,) root mean square position residual over the poses [m]."""
    residual_rad: Floats
    """(S,) root mean square orientation residual over the poses [rad]."""
    pose_numbers: tuple[int, ...]
    """(P,) index of each pose in `poses.POSES`; the others were left out."""
    hinge_error_rad: float
    """Error of the performer's poses, standard deviation of a hinge [rad]."""
    pose_error_rad: Floats
    """(P,) error of each pose, standard deviation of a hinge [rad]."""
    pose_distance_m: Floats
    """(P, S) distance of each station from its place in each pose as shown [m]."""
    mount_spread: float
    """Spread of trackers about their nominal mounts, in units of `held_pose_model.MOUNT_*_SD_M`."""
    hints: tuple[str, ...]
    """Sentences about straps that are put on in an unusual orientation."""
    seconds: float
    """Total length of the holds [s]."""

    def __post_init__(self) -> None:
        bones, stations = self.skeleton.bone_count, len(self.calibration.stations)
        freeze(self, mean_m=(bones,), length_sd_m=(bones,), length_bound_m=(bones,), variance_reduction=(bones,))
        freeze(self, np.bool_, from_prior=(bones,))
        freeze(self, mount_sd_m=(stations,), mount_sd_rad=(stations,), residual_m=(stations,), residual_rad=(stations,))
        freeze(self, mount_bound_m=(stations,), mount_bound_rad=(stations,), pose_error_rad=("P",))
        freeze(self, pose_distance_m=(len(self.pose_error_rad), stations))


def calibrate_poses(
    held: Sequence[Sequence[TrackerFrame]], space: SkeletonPrior, mounts: Sequence[Mount]
) -> PoseCalibration:
    """Estimate skeleton, mounts and room from the frames of the eight holds, in the order of `poses.POSES`.

    A hold without frames is left out. `mounts` are the nominal positions of the trackers, in the order of the stream's
    stations; orientations are free.
    UnusableHold names the pose and the station and what to do. BadInput for a wrong number of poses or stations.
    """
    holds = measure_poses(held, mounts)
    bundle = pose_bundle(holds, space, mounts)
    pose_checks.require_no_boresight(bundle)
    fit = fit_bundle(bundle, *_reading_sd(list(holds.values())))
    numbers = tuple(holds)
    pose_checks.require_poses_held(bundle, fit, numbers)
    seconds = sum(hold.seconds for hold in holds.values())
    return _assemble(bundle, fit, numbers, estimate_uncertainty(bundle, fit), seconds)


def measure_poses(held: Sequence[Sequence[TrackerFrame]], mounts: Sequence[Mount]) -> dict[int, HoldReadings]:
    """Median readings of the holds by the pose's index in `poses.POSES`, without holds that have no frames.

    UnusableHold, also without the first pose or with fewer than `LEAST_POSES`. BadInput.
    """
    if len(held) != len(POSES):
        raise BadInput(
            f"{len(held)} poses were held; {len(POSES)} are needed.",
            f"Hold these, one after another: {', '.join(pose.name for pose in POSES)}.",
        )
    names = [mount.station for mount in mounts]
    numbers = [number for number, rows in enumerate(held) if rows]
    if 0 not in numbers or len(numbers) < LEAST_POSES:
        raise UnusableHold(
            f"Only {len(numbers)} of the poses were held while all stations reported; the first and "
            f"{LEAST_POSES - 1} others are needed.",
            "Stand where the emitters reach all stations, and hold the poses again.",
        )
    return {number: measure_hold(held[number], names, POSES[number].name) for number in numbers}


def pose_bundle(holds: Mapping[int, HoldReadings], space: SkeletonPrior, mounts: Sequence[Mount]) -> BundleAdjustment:
    """The least-squares problem of the holds, by the pose's index in `poses.POSES`, with the poses as shown."""
    like = humanoid24.standard_skeleton()
    nominal_rad = np.array([pose_angles_rad(pose, like) for pose in map(POSES.__getitem__, holds)])
    readings = holds.values()
    turn = rotations.multiply(LEVEL_FROM_TRACKER, np.array([hold.tracker_from_station for hold in readings]))
    place_m = rotations.rotate(LEVEL_FROM_TRACKER, np.array([hold.position_m for hold in readings]))
    return BundleAdjustment(SharedUnknowns(like, space, mounts), nominal_rad, place_m, rotations.to_matrix(turn))


def _reading_sd(holds: Sequence[HoldReadings]) -> tuple[float, float]:
    """Standard deviations of median positions [m] and orientations [rad] on an axis, from the scatter within holds.

    Device errors are correlated over about a second, so a median is hardly better than a single reading.
    """
    moved_m = float(np.median([hold.moved_m for hold in holds])) * _SD_PER_QUARTILE
    turned_rad = float(np.median([hold.turned_rad for hold in holds])) * _SD_PER_QUARTILE
    return float(np.hypot(FLOOR_M, moved_m)), float(np.hypot(FLOOR_RAD, turned_rad))


def calibration_of(kind: str, at: CalibrationSolution, skeleton: Skeleton, mounts: Sequence[Mount]) -> Calibration:
    """The calibration of a solution; the first pose stands at the world's origin and faces x."""
    world_from_level, shift_m = _world_from_level(skeleton, at)
    return Calibration(
        kind=kind,
        stations=tuple(mount.station for mount in mounts),
        bones=tuple(mount.bone for mount in mounts),
        mount_m=at.mount_m,
        bone_from_station=rotations.from_matrix(at.bone_from_station),
        world_from_tracker=rotations.multiply(world_from_level, LEVEL_FROM_TRACKER),
        tracker_origin_m=shift_m,
    )


def _assemble(
    bundle: BundleAdjustment,
    fit: BundleFit,
    numbers: tuple[int, ...],
    uncertainty: CalibrationUncertainty,
    seconds: float,
) -> PoseCalibration:
    at, mounts = fit.solution, bundle.shared.mounts
    skeleton = bundle.shared.template.with_bones(at.bone_m)
    calibration = calibration_of("poses", at, skeleton, mounts)
    off_m, off_rad = bundle.residuals(bundle.forward_kinematics(at))
    return PoseCalibration(
        **vars(uncertainty),
        calibration=calibration,
        skeleton=skeleton,
        mean_m=bundle.shared.space.mean_m,
        from_prior=uncertainty.variance_reduction < LEAST_VARIANCE_REDUCTION,
        residual_m=np.sqrt(np.mean(np.sum(off_m**2, axis=2), axis=0)),
        residual_rad=np.sqrt(np.mean(np.sum(off_rad**2, axis=2), axis=0)),
        pose_numbers=numbers,
        hinge_error_rad=fit.scales.pose_error_rad,
        pose_error_rad=fit.pose_error_rad,
        pose_distance_m=pose_checks.pose_distances_m(bundle, fit),
        mount_spread=fit.scales.mount_spread,
        hints=pose_checks.strap_hints(skeleton, mounts, calibration.bone_from_station),
        seconds=seconds,
    )


def _world_from_level(skeleton: Skeleton, at: CalibrationSolution) -> tuple[Floats, Floats]:
    """World from level axes: rotation (4,) and translation (3,) [m].

    The first pose stands at the origin and faces x. The floor is the median height of the lower sole over the poses.
    """
    root = rotations.from_matrix(at.world_from_root)
    qpos = humanoid24.pack(at.root_m, root, at.angles_rad)
    soles_m = np.min(sole_heights_m(skeleton, pose_from_qpos(skeleton, qpos)), axis=1)
    turn = rotations.about_z(-float(rotations.yaw_rad(root[0])))
    origin_m = np.array([*at.root_m[0, :2], np.median(soles_m)])
    return turn, -rotations.rotate(turn, origin_m)
