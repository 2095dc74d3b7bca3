"""The scales that a bundle fit estimates, and its weights, against planted values and written-out formulas."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.calibrate.bundle_adjustment import BundleAdjustment
from harness.calibrate.bundle_fit import LEAST_MOUNT_SPREAD, MOST_MOUNT_SPREAD, BundleFit, fit_bundle
from harness.calibrate.poses import POSES, pose_angles_rad
from harness.calibrate.unknowns import CalibrationSolution, SharedUnknowns
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from tests.calibrate.standing_model import SIX, Model, space
from tests.calibrate.test_bundle_adjustment import whole

LIKE = standard_skeleton()
MOUNTS = Model(LIKE, SIX).mounts
ALONG_M, ACROSS_M = 0.03, 0.015
"""Standard deviations of trackers about their nominal mounts, as docs/calibration.md has them [m]."""
POSITION_SD_M, ORIENTATION_SD_RAD = 0.0005, 0.002


def bundle_with(mount_error_m: Floats, spoil: Callable[[Floats], None] = lambda place_m: None) -> BundleAdjustment:
    """Readings of the mean skeleton in the exact poses, with mounts displaced by (S, 3) in their bones' frames."""
    shared = SharedUnknowns(LIKE, space(), MOUNTS)
    asked = np.array([pose_angles_rad(pose, LIKE) for pose in POSES])
    bundle = BundleAdjustment(shared, asked, np.zeros((8, 6, 3)), np.tile(np.eye(3), (8, 6, 1, 1)))
    at = bundle.start()
    worn = CalibrationSolution(
        at.bone_m,
        at.weights_m,
        at.mount_m + mount_error_m,
        at.bone_from_station,
        *(at.root_m, at.world_from_root),
        at.angles_rad,
    )
    reached = bundle.forward_kinematics(worn)
    place_m = np.array(reached.place_m)
    spoil(place_m)
    return BundleAdjustment(shared, asked, place_m, np.array(reached.world_from_station))


def mount_errors(size: float, rng: np.random.Generator) -> Floats:
    """(S, 3) errors of `size` standard deviations on each axis, of random sign; the bones' rest axes are those of x."""
    shared = SharedUnknowns(LIKE, space(), MOUNTS)
    along = shared.space.direction[shared.carriers]
    across = np.linalg.qr(np.concatenate([along[:, :, None], rng.normal(size=(6, 3, 2))], axis=2))[0][:, :, 1:]
    sign = rng.choice([-1.0, 1.0], (6, 3))
    out: Floats = size * (
        ALONG_M * sign[:, :1] * along + ACROSS_M * (sign[:, 1:2] * across[:, :, 0] + sign[:, 2:] * across[:, :, 1])
    )
    return out


def fit(bundle: BundleAdjustment) -> BundleFit:
    return fit_bundle(bundle, POSITION_SD_M, ORIENTATION_SD_RAD)


def test_the_spread_of_the_mounts_follows_the_planted_one(rng: np.random.Generator) -> None:
    """Mounts that are all off by s standard deviations have the spread s; the limits hold beyond 0.1 and 3."""
    errors = mount_errors(1.0, rng)
    found = [fit(bundle_with(size * errors)).scales.mount_spread for size in (0.4, 0.8, 1.6)]
    np.testing.assert_allclose(found, [0.4, 0.8, 1.6], rtol=0.3)
    assert fit(bundle_with(0.0 * errors)).scales.mount_spread == LEAST_MOUNT_SPREAD
    assert (LEAST_MOUNT_SPREAD, MOST_MOUNT_SPREAD) == (0.1, 3.0)


def test_readings_are_weighted_by_the_t_distribution(rng: np.random.Generator) -> None:
    """Four degrees of freedom: (4 + 3) / (4 + d^2) for a residual of d standard deviations in three axes, at most 1."""

    def spoil(place_m: Floats) -> None:
        place_m += 2.0 * POSITION_SD_M * rng.normal(size=place_m.shape)
        place_m[5, 3] += [0.0, 0.05, 0.0]

    bundle = bundle_with(mount_errors(0.3, rng), spoil)
    found = fit(bundle)
    off_m, off_rad = bundle.residuals(bundle.forward_kinematics(found.solution))
    for k, off in enumerate((off_m / POSITION_SD_M, off_rad / ORIENTATION_SD_RAD)):
        squared = np.sum(off**2, axis=2)
        np.testing.assert_allclose(found.weight[..., k], np.minimum(7.0 / (4.0 + squared), 1.0), rtol=1e-12)
    assert found.weight[5, 3, 0] < 0.01
    assert np.median(found.weight[..., 0]) > 0.5


def test_a_reading_far_off_moves_the_mounts_less_than_its_share(rng: np.random.Generator) -> None:
    """One of eight positions of a station is 5 cm off. Least squares would move its mount by an eighth of that."""

    def spoil(place_m: Floats) -> None:
        place_m[5, 3] += [0.0, 0.05, 0.0]

    errors = mount_errors(0.3, rng)
    plain, spoilt = fit(bundle_with(errors)).solution, fit(bundle_with(errors, spoil)).solution
    assert np.linalg.norm(spoilt.mount_m - plain.mount_m, axis=1).max() < 0.002
    assert rotations.angle_between_rad(
        rotations.from_matrix(spoilt.bone_from_station), rotations.from_matrix(plain.bone_from_station)
    ).max() < np.deg2rad(0.5)


@pytest.mark.parametrize("size", [0.4, 1.6])
def test_the_spread_is_the_fixed_point_of_mackay(size: float, rng: np.random.Generator) -> None:
    """At the end s^2 (n - trace of the prior times the posterior) is the sum of squared errors, in units of s = 1."""
    bundle = bundle_with(mount_errors(size, rng))
    found = fit(bundle)
    residual, slope = bundle.shared.mount_prior_residuals(found.solution, 1.0, found.scales.skin_offset_m)
    count = 18 - np.trace(slope @ found.covariance @ slope.T) / found.scales.mount_spread**2
    assert found.scales.mount_spread == pytest.approx(np.sqrt(residual @ residual / count), rel=5e-3)


def test_the_uncertainty_of_the_heading_is_that_of_the_first_root_about_the_vertical(rng: np.random.Generator) -> None:
    """It is read from the inverse of the full normal matrix: shared unknowns, then root position and rotation."""
    bundle = bundle_with(mount_errors(0.3, rng))
    found = fit(bundle)
    covariance = np.linalg.inv(whole(found.normal)[0])
    place = bundle.shared.count + 5
    assert found.heading_sd_rad == pytest.approx(np.sqrt(covariance[place, place]), rel=1e-4)
    others = [np.sqrt(covariance[k, k]) for k in (place - 2, place - 1, place + 1)]
    assert np.abs(np.array(others) / found.heading_sd_rad - 1.0).min() > 0.01
