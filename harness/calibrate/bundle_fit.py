"""Maximum a posteriori bones, mounts and poses of an eight-pose calibration.

Two scales are estimated rather than set: how far hinges miss the poses, and how far trackers sit from their nominal
mounts. Both maximise the evidence of the readings (empirical Bayes; the fixed point of MacKay 1992, "Bayesian
interpolation"). Readings follow a Student t distribution, so outliers count less (docs/is900.md 13.1, excursions).
"""

from dataclasses import dataclass, replace

import numpy as np

from harness.calibrate.bundle_adjustment import BundleAdjustment, NormalEquations, ResidualScales
from harness.calibrate.unknowns import CalibrationSolution
from harness.core.arrays import Floats

START_POSE_ERROR_RAD = float(np.deg2rad(2.5))
LEAST_POSE_ERROR_RAD, MOST_POSE_ERROR_RAD = float(np.deg2rad(0.005)), float(np.deg2rad(15.0))
"""Range of the estimated pose error; a performer beyond it is asked to try again [rad] [choice]."""
LEAST_MOUNT_SPREAD, MOST_MOUNT_SPREAD = 0.1, 3.0
"""Range of the estimated mount spread: trackers sit 3 mm to 9 cm from their nominal mounts [choice]."""
T_DEGREES_OF_FREEDOM = 4.0
"""Degrees of freedom of the readings' t distribution [choice]."""
_ROUNDS, _LEAST_ROUNDS, _TOLERANCE = 40, 3, 1e-3


@dataclass(frozen=True, eq=False)
class BundleFit:
    """The solution, the scales of its residuals, and its normal equations."""

    solution: CalibrationSolution
    scales: ResidualScales
    weight: Floats
    """(P, S, 2) robust weight of each position and orientation, 0 to 1; small for outliers."""
    normal: NormalEquations
    covariance: Floats
    """(X, X) covariance of the shared unknowns."""
    pose_error_rad: Floats
    """(P,) error of the hinges in each pose, standard deviation [rad]."""
    heading_sd_rad: float
    """Standard deviation of the performer's heading in the first pose [rad]."""
    rounds: int


def fit_bundle(bundle: BundleAdjustment, position_sd_m: float, orientation_sd_rad: float) -> BundleFit:
    """Fit a bundle; `position_sd_m` and `orientation_sd_rad` are standard deviations of the readings on each axis."""
    at = bundle.start()
    scales = ResidualScales(
        START_POSE_ERROR_RAD, 1.0, bundle.shared.skin_offset_m(at.bone_m), position_sd_m, orientation_sd_rad
    )
    weight, damping = np.ones((*bundle.place_m.shape[:2], 2)), 1e-3
    for rounds in range(1, _ROUNDS + 1):
        normal = bundle.normal_equations(at, scales, weight)
        at, damping, gained = levenberg_marquardt_step(bundle, at, normal, scales, weight, damping)
        # The variances are those before the step; at convergence both are the same.
        before, scales = scales, _likeliest_scales(bundle, at, scales, *normal.variances())
        if rounds <= _LEAST_ROUNDS:  # later the body's size hardly changes
            scales = replace(scales, skin_offset_m=bundle.shared.skin_offset_m(at.bone_m))
        weight = _weights(bundle, at, scales)
        change = abs(np.log(scales.pose_error_rad / before.pose_error_rad)) + abs(
            np.log(scales.mount_spread / before.mount_spread)
        )
        if rounds > _LEAST_ROUNDS and change < _TOLERANCE and gained < _TOLERANCE:
            break
    normal = bundle.normal_equations(at, scales, weight)
    covariance, pose_variance = normal.variances()
    pose_error_rad, heading_sd_rad = (
        _pose_error_rad(bundle, at, scales, pose_variance),
        float(np.sqrt(pose_variance[0, 5])),
    )
    return BundleFit(at, scales, weight, normal, covariance, pose_error_rad, heading_sd_rad, rounds)


def levenberg_marquardt_step(
    bundle: BundleAdjustment,
    at: CalibrationSolution,
    normal: NormalEquations,
    scales: ResidualScales,
    weight: Floats,
    damping: float,
) -> tuple[CalibrationSolution, float, float]:
    """One Levenberg-Marquardt step: the new solution, the next damping and the decrease of the cost."""
    cost = bundle.cost(at, scales, weight)
    while damping < 1e8:
        candidate = bundle.apply_step(at, normal.step(damping))
        if (then := bundle.cost(candidate, scales, weight)) < cost:
            return candidate, max(damping / 10.0, 1e-9), cost - then
        damping *= 10.0
    return at, 1e-3, 0.0


def _likeliest_scales(
    bundle: BundleAdjustment, at: CalibrationSolution, scales: ResidualScales, covariance: Floats, pose_variance: Floats
) -> ResidualScales:
    """Scales that maximise the evidence, given the solution and its uncertainty (MacKay's fixed point)."""
    squared_error = bundle.pose_errors(at)[:, 2:] ** 2
    pose_error_rad = float(np.sqrt(np.sum(squared_error) / np.sum(_effective_hinges(scales, pose_variance))))
    residual, slope = bundle.shared.mount_prior_residuals(at, scales.mount_spread, scales.skin_offset_m)
    effective = max(len(residual) - float(np.sum((slope @ covariance) * slope)), 1.0)
    mount_spread = scales.mount_spread * float(np.sqrt(residual @ residual / effective))
    return replace(
        scales,
        pose_error_rad=float(np.clip(pose_error_rad, LEAST_POSE_ERROR_RAD, MOST_POSE_ERROR_RAD)),
        mount_spread=float(np.clip(mount_spread, LEAST_MOUNT_SPREAD, MOST_MOUNT_SPREAD)),
    )


def _pose_error_rad(
    bundle: BundleAdjustment, at: CalibrationSolution, scales: ResidualScales, pose_variance: Floats
) -> Floats:
    squared_error = bundle.pose_errors(at)[:, 2:] ** 2
    return np.asarray(np.sqrt(np.sum(squared_error, axis=1) / _effective_hinges(scales, pose_variance)))


def _effective_hinges(scales: ResidualScales, pose_variance: Floats) -> Floats:
    """(P,) effective number of hinges that the readings determine in each pose, from variances (P, 6 + H)."""
    return np.asarray(np.maximum(np.sum(1.0 - pose_variance[:, 6:] / scales.pose_error_rad**2, axis=1), 1.0))


def _weights(bundle: BundleAdjustment, at: CalibrationSolution, scales: ResidualScales) -> Floats:
    """(P, S, 2) weights of readings that are t-distributed about the prediction."""
    off = (
        np.stack(bundle.residuals(bundle.forward_kinematics(at)), axis=2)
        / np.array([scales.position_sd_m, scales.orientation_sd_rad])[:, None]
    )
    counts = (T_DEGREES_OF_FREEDOM + 3.0) / (T_DEGREES_OF_FREEDOM + np.sum(off**2, axis=3))
    return np.asarray(np.minimum(counts, 1.0))
