"""How well bones and mounts are known after a fit: Cramér-Rao bounds with and without what is expected beforehand."""

from dataclasses import dataclass

import numpy as np

from harness.calibrate.bundle_adjustment import BundleAdjustment
from harness.calibrate.bundle_fit import BundleFit
from harness.core.arrays import Floats

_UNINFORMATIVE, _ROUNDING = 1e-4, 1e-10
"""Readings tell nothing of a combination when they have less than this share of what is known of it beforehand, or of
the best known combination, which rounding leaves."""
_UNKNOWN_MOUNT_SPREAD = 100.0
"""Spread of the trackers about their nominal mounts, in its units, that stands for not knowing where they sit."""


@dataclass(frozen=True, eq=False)
class CalibrationUncertainty:
    """N bones, S stations."""

    length_sd_m: Floats
    length_bound_m: Floats
    variance_reduction: Floats
    """(N,) of the variance among people that readings take away when nominal mounts are not believed."""
    mount_sd_m: Floats
    mount_sd_rad: Floats
    mount_bound_m: Floats
    mount_bound_rad: Floats
    condition: float


def estimate_uncertainty(bundle: BundleAdjustment, found: BundleFit) -> CalibrationUncertainty:
    """By the normal equations at the solution: misses of the poses are unknown and marginalised."""
    shared, at, scales = bundle.shared, found.solution, found.scales
    _, slope = shared.prior_residuals(at, scales.mount_spread, scales.skin_offset_m)
    whole = found.normal.information()
    readings = whole - slope.T @ slope
    _, wide = shared.prior_residuals(at, _UNKNOWN_MOUNT_SPREAD, scales.skin_offset_m)
    lengths = shared.length_jacobian(at)
    prior_m2 = np.diag(shared.space.covariance_m2)
    scale = _prior_sd(slope)
    sd, alone = found.covariance, _inverse(readings, scale)
    strange = lengths @ np.linalg.inv(readings + wide.T @ wide) @ lengths.T
    return CalibrationUncertainty(
        length_sd_m=np.sqrt(np.diag(lengths @ sd @ lengths.T)),
        length_bound_m=np.sqrt(_variance(lengths, alone, scale)),
        variance_reduction=1.0 - np.diag(strange) / prior_m2,
        mount_sd_m=_total_sd(np.diag(sd)[shared.mount]),
        mount_sd_rad=_total_sd(np.diag(sd)[shared.turn]),
        mount_bound_m=_total_sd(_variance(np.eye(shared.count)[shared.mount], alone, scale)),
        mount_bound_rad=_total_sd(_variance(np.eye(shared.count)[shared.turn], alone, scale)),
        condition=float(np.linalg.cond(whole * np.outer(scale, scale))),
    )


def _prior_sd(slope: Floats) -> Floats:
    """(X,) what is known of each unknown beforehand [its unit]; 1 where nothing is."""
    information = np.sum(slope**2, axis=0)
    return np.where(information > 0.0, 1.0 / np.sqrt(np.maximum(information, 1e-300)), 1.0)


def _inverse(information: Floats, scale: Floats) -> tuple[Floats, Floats]:
    """Covariance (X, X) of what is told, and directions (X, K) of which nothing is."""
    value, vector = np.linalg.eigh(information * np.outer(scale, scale))
    told = value > max(_UNINFORMATIVE, _ROUNDING * float(value[-1]))
    vector = vector * scale[:, None]
    return (vector[:, told] / value[told]) @ vector[:, told].T, vector[:, ~told]


def _variance(rows: Floats, alone: tuple[Floats, Floats], scale: Floats) -> Floats:
    """(R,) of combinations (R, X); infinite where one has a part of which nothing is told."""
    covariance, untold = alone
    told: Floats = np.sum((rows @ covariance) * rows, axis=1)
    part = np.sum((rows @ untold) ** 2, axis=1) / np.sum((rows * scale) ** 2, axis=1)
    return np.where(part > 1e-4, np.inf, told)


def _total_sd(variance: Floats) -> Floats:
    """(S,) root of the sum over three axes (3 S,)."""
    out: Floats = np.sqrt(np.sum(variance.reshape(-1, 3), axis=1))
    return out
