"""The most likely bones, mounts and poses behind readings, and how far the performer missed the poses.

How far hinges miss and how far trackers sit from their nominal mounts is not told beforehand: both spreads are those
under which the readings are likeliest (empirical Bayes; the fixed point of MacKay 1992, "Bayesian interpolation").
Readings that still do not fit count less: Student's t about what the device wanders by itself (docs/is900.md 13.1,
excursions).
"""

from dataclasses import dataclass, replace

import numpy as np

from harness.calibrate.bundle_adjustment import BundleAdjustment, NormalEquations, ResidualScales
from harness.calibrate.unknowns import CalibrationSolution
from harness.core.arrays import Floats

START_POSE_ERROR_RAD = float(np.deg2rad(2.5))
LEAST_POSE_ERROR_RAD, MOST_POSE_ERROR_RAD = float(np.deg2rad(0.005)), float(np.deg2rad(15.0))
"""Nobody hits a pose better, and who misses it more is asked to try again [choice]."""
LEAST_MOUNT_SPREAD, MOST_MOUNT_SPREAD = 0.1, 3.0
"""Trackers are nowhere within 3 mm, and nowhere beyond 9 cm, of where they are said to be [choice]."""
T_DEGREES_OF_FREEDOM = 4.0
"""Degrees of freedom of the readings' t distribution [choice]."""
_ROUNDS, _LEAST_ROUNDS, _TOLERANCE = 40, 3, 1e-3


@dataclass(frozen=True, eq=False)
class BundleFit:
    """The solution, what it was measured by, and its normal equations."""

    solution: CalibrationSolution
    scales: ResidualScales
    weight: Floats
    """(P, S, 2) of each place and turn; small for what does not fit."""
    normal: NormalEquations
    covariance: Floats
    """(X, X) of the shared unknowns."""
    pose_miss_rad: Floats
    """(P,) how far hinges missed each pose, standard deviation."""
    heading_sd_rad: float
    """How well stations tell which way the performer faced in the first pose, standard deviation."""
    rounds: int


def fit_bundle(bundle: BundleAdjustment, place_m: float, turn_rad: float) -> BundleFit:
    """`place_m` and `turn_rad` are standard deviations of the readings on each axis."""
    at = bundle.start()
    given = ResidualScales(START_POSE_ERROR_RAD, 1.0, bundle.shared.flesh_m(at.bone_m), place_m, turn_rad)
    weight, damping = np.ones((*bundle.place_m.shape[:2], 2)), 1e-3
    for rounds in range(1, _ROUNDS + 1):
        normal = bundle.normal(at, given, weight)
        at, damping, gained = levenberg_marquardt_step(bundle, at, normal, given, weight, damping)
        # Of the solution before the step, which is the same in the end.
        before, given = given, _likeliest_scales(bundle, at, given, *normal.variances())
        if rounds <= _LEAST_ROUNDS:  # the body's size hardly changes any more
            given = replace(given, flesh_m=bundle.shared.flesh_m(at.bone_m))
        weight = _weights(bundle, at, given)
        change = abs(np.log(given.pose_error_rad / before.pose_error_rad)) + abs(
            np.log(given.mount_spread / before.mount_spread)
        )
        if rounds > _LEAST_ROUNDS and change < _TOLERANCE and gained < _TOLERANCE:
            break
    normal = bundle.normal(at, given, weight)
    covariance, own = normal.variances()
    missed_rad, heading_sd_rad = _pose_error_rad(bundle, at, given, own), float(np.sqrt(own[0, 5]))
    return BundleFit(at, given, weight, normal, covariance, missed_rad, heading_sd_rad, rounds)


def levenberg_marquardt_step(
    bundle: BundleAdjustment,
    at: CalibrationSolution,
    normal: NormalEquations,
    given: ResidualScales,
    weight: Floats,
    damping: float,
) -> tuple[CalibrationSolution, float, float]:
    """One step of Levenberg and Marquardt, the damping for the next, and what the step gained, in squared units of
    the residuals."""
    cost = bundle.cost(at, given, weight)
    while damping < 1e8:
        tried = bundle.moved(at, normal.step(damping))
        if (then := bundle.cost(tried, given, weight)) < cost:
            return tried, max(damping / 10.0, 1e-9), cost - then
        damping *= 10.0
    return at, 1e-3, 0.0


def _likeliest_scales(
    bundle: BundleAdjustment, at: CalibrationSolution, given: ResidualScales, covariance: Floats, own: Floats
) -> ResidualScales:
    """Those under which the solution and its uncertainty are likeliest."""
    missed = bundle.pose_errors(at)[:, 2:] ** 2
    miss_rad = float(np.sqrt(np.sum(missed) / np.sum(_effective_hinges(given, own))))
    residual, slope = bundle.shared.mount_prior_residuals(at, given.mount_spread, given.flesh_m)
    told = max(len(residual) - float(np.sum((slope @ covariance) * slope)), 1.0)
    beside = given.mount_spread * float(np.sqrt(residual @ residual / told))
    return replace(
        given,
        pose_error_rad=float(np.clip(miss_rad, LEAST_POSE_ERROR_RAD, MOST_POSE_ERROR_RAD)),
        mount_spread=float(np.clip(beside, LEAST_MOUNT_SPREAD, MOST_MOUNT_SPREAD)),
    )


def _pose_error_rad(bundle: BundleAdjustment, at: CalibrationSolution, given: ResidualScales, own: Floats) -> Floats:
    missed = bundle.pose_errors(at)[:, 2:] ** 2
    return np.asarray(np.sqrt(np.sum(missed, axis=1) / _effective_hinges(given, own)))


def _effective_hinges(given: ResidualScales, own: Floats) -> Floats:
    """(P,) how many hinges' worth the readings tell of each pose, given variances (P, 6 + H)."""
    return np.asarray(np.maximum(np.sum(1.0 - own[:, 6:] / given.pose_error_rad**2, axis=1), 1.0))


def _weights(bundle: BundleAdjustment, at: CalibrationSolution, given: ResidualScales) -> Floats:
    """(P, S, 2) of readings that are t-distributed about the prediction."""
    off = np.stack(bundle.residuals(bundle.reach(at)), axis=2) / np.array([given.place_m, given.turn_rad])[:, None]
    counts = (T_DEGREES_OF_FREEDOM + 3.0) / (T_DEGREES_OF_FREEDOM + np.sum(off**2, axis=3))
    return np.asarray(np.minimum(counts, 1.0))
