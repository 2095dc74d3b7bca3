"""Maximum a posteriori bones, mounts and poses of an eight-pose calibration, and their Cramér-Rao bounds.

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
    squared_error = np.sum(bundle.pose_errors(at)[:, 2:] ** 2, axis=1)
    pose_error_rad: Floats = np.sqrt(squared_error / _effective_hinges(scales, pose_variance))
    heading_sd_rad = float(np.sqrt(pose_variance[0, 5]))
    return BundleFit(at, scales, weight, normal, covariance, pose_error_rad, heading_sd_rad)


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


_UNINFORMATIVE, _ROUNDING = 1e-4, 1e-10
"""A combination of unknowns counts as undetermined if the readings' information is below this share of the prior's,
or below this share of the largest eigenvalue (rounding)."""
_UNKNOWN_MOUNT_SPREAD = 100.0
"""Mount spread that stands for an uninformative prior of the mounts."""


@dataclass(frozen=True, eq=False)
class CalibrationUncertainty:
    """Standard deviations and bounds of N bone lengths and S mounts."""

    length_sd_m: Floats
    """(N,) standard deviation of the lengths [m]: the Cramér-Rao bound with the prior of people's bones."""
    length_bound_m: Floats
    """(N,) the bound of unbiased estimators, without the prior [m]; infinite where the readings do not depend on it."""
    variance_reduction: Floats
    """(N,) share by which readings reduce the variance among people, without a prior of the mounts."""
    mount_sd_m: Floats
    """(S,) standard deviation of the mounts' positions, all axes together [m]."""
    mount_sd_rad: Floats
    """(S,) standard deviation of the mounts' orientations, all axes together [rad]."""
    mount_bound_m: Floats
    """(S,) bound of the positions without priors of bones and mounts [m]."""
    mount_bound_rad: Floats
    """(S,) bound of the orientations without these priors [rad]."""
    condition: float
    """Condition number of the whitened normal matrix."""


def estimate_uncertainty(bundle: BundleAdjustment, fit: BundleFit) -> CalibrationUncertainty:
    """Bounds from the normal equations at the solution, with pose errors marginalised."""
    shared, at, scales = bundle.shared, fit.solution, fit.scales
    _, slope = shared.prior_residuals(at, scales.mount_spread, scales.skin_offset_m)
    information = fit.normal.information()
    readings = information - slope.T @ slope
    _, weak_slope = shared.prior_residuals(at, _UNKNOWN_MOUNT_SPREAD, scales.skin_offset_m)
    lengths = shared.length_jacobian(at)
    prior_m2 = np.diag(shared.space.covariance_m2)
    scale = _prior_sd(slope)
    sd, alone = fit.covariance, _inverse(readings, scale)
    without_mounts = lengths @ np.linalg.inv(readings + weak_slope.T @ weak_slope) @ lengths.T
    return CalibrationUncertainty(
        length_sd_m=np.sqrt(np.diag(lengths @ sd @ lengths.T)),
        length_bound_m=np.sqrt(_variance(lengths, alone, scale)),
        variance_reduction=1.0 - np.diag(without_mounts) / prior_m2,
        mount_sd_m=_total_sd(np.diag(sd)[shared.mount]),
        mount_sd_rad=_total_sd(np.diag(sd)[shared.turn]),
        mount_bound_m=_total_sd(_variance(np.eye(shared.count)[shared.mount], alone, scale)),
        mount_bound_rad=_total_sd(_variance(np.eye(shared.count)[shared.turn], alone, scale)),
        condition=float(np.linalg.cond(information * np.outer(scale, scale))),
    )


def _prior_sd(slope: Floats) -> Floats:
    """(X,) prior standard deviation of each unknown, in its unit; 1 where there is no prior."""
    information = np.sum(slope**2, axis=0)
    return np.where(information > 0.0, 1.0 / np.sqrt(np.maximum(information, 1e-300)), 1.0)


def _inverse(information: Floats, scale: Floats) -> tuple[Floats, Floats]:
    """Pseudo-inverse (X, X) of an information matrix, and K undetermined directions (X, K)."""
    value, vector = np.linalg.eigh(information * np.outer(scale, scale))
    determined = value > max(_UNINFORMATIVE, _ROUNDING * float(value[-1]))
    vector = vector * scale[:, None]
    return (vector[:, determined] / value[determined]) @ vector[:, determined].T, vector[:, ~determined]


def _variance(rows: Floats, alone: tuple[Floats, Floats], scale: Floats) -> Floats:
    """(R,) variance of combinations (R, X); infinite for one with an undetermined part."""
    covariance, undetermined = alone
    variance: Floats = np.sum((rows @ covariance) * rows, axis=1)
    part = np.sum((rows @ undetermined) ** 2, axis=1) / np.sum((rows * scale) ** 2, axis=1)
    return np.where(part > 1e-4, np.inf, variance)


def _total_sd(variance: Floats) -> Floats:
    """(S,) root of the summed variances of three axes (3 S,)."""
    out: Floats = np.sqrt(np.sum(variance.reshape(-1, 3), axis=1))
    return out
