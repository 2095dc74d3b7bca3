"""Cramér-Rao bounds of bones and mounts after a fit, with and without the prior."""

from dataclasses import dataclass

import numpy as np

from harness.calibrate.bundle_adjustment import BundleAdjustment
from harness.calibrate.bundle_fit import BundleFit
from harness.core.arrays import Floats

_UNINFORMATIVE, _ROUNDING = 1e-4, 1e-10
"""A combination of unknowns counts as undetermined if the readings' information is below this share of the prior's,
or below this share of the largest eigenvalue (rounding)."""
_UNKNOWN_MOUNT_SPREAD = 100.0
"""Mount spread that stands for an uninformative prior of the mounts."""


@dataclass(frozen=True, eq=False)
class CalibrationUncertainty:
    """Standard deviations and bounds of N bone lengths and S mounts; `PoseCalibration` explains each."""

    length_sd_m: Floats
    length_bound_m: Floats
    variance_reduction: Floats
    """(N,) share by which readings reduce the variance among people, without a prior of the mounts."""
    mount_sd_m: Floats
    mount_sd_rad: Floats
    mount_bound_m: Floats
    mount_bound_rad: Floats
    condition: float


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
