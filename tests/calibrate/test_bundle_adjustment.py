"""The normal equations: gradients against finite differences, elimination of poses against the full system."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS
from harness.calibrate.bundle_adjustment import (
    BundleAdjustment,
    NormalEquations,
    ResidualScales,
)
from harness.calibrate.held_pose_model import heading_between_rad
from harness.calibrate.poses import POSES, pose_angles_rad
from harness.calibrate.unknowns import CalibrationSolution, SharedUnknowns
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from tests.calibrate.standing_model import SIX, space

LIKE = standard_skeleton()
STEP = 1e-6


def setting(rng: np.random.Generator) -> tuple[BundleAdjustment, CalibrationSolution, ResidualScales]:
    """A solution near the start, with readings that fit it up to small errors."""
    shared = SharedUnknowns(LIKE, space(), [DEFAULT_MOUNTS[station] for station in SIX])
    asked = np.array([pose_angles_rad(pose, LIKE) for pose in POSES])
    bundle = BundleAdjustment(shared, asked, rng.normal(size=(8, 6, 3)), np.tile(np.eye(3), (8, 6, 1, 1)))
    at = bundle.start()
    own = 0.1 * rng.normal(size=(8, 6 + len(bundle.hinges)))
    at = bundle.apply_step(at, (0.01 * rng.normal(size=shared.count), own))
    reached = bundle.forward_kinematics(at)
    bundle.place_m = reached.place_m + 1e-7 * rng.normal(size=(8, 6, 3))
    bundle.turn = reached.world_from_station @ _small_turns(1e-7, rng)
    return bundle, at, ResidualScales(0.04, 0.8, shared.skin_offset_m(at.bone_m), 0.002, 0.01)


def _small_turns(size_rad: float, rng: np.random.Generator) -> Floats:
    return rotations.to_matrix(rotations.exp(size_rad * rng.normal(size=(8, 6, 3))))


def test_the_slope_of_the_cost(rng: np.random.Generator) -> None:
    """The right-hand side is minus half the cost's gradient, for shared unknowns and for those of a pose."""
    bundle, at, scales = setting(rng)
    weight = rng.uniform(0.2, 1.0, size=(8, 6, 2))
    normal = bundle.normal_equations(at, scales, weight)
    none = np.zeros(bundle.shared.count), np.zeros(normal.pose_gradient.shape)

    def slope(which: int, index: tuple[int, ...]) -> float:
        costs = []
        for sign in (STEP, -STEP):
            step = [np.array(part) for part in none]
            step[which][index] = sign
            costs.append(bundle.cost(bundle.apply_step(at, (step[0], step[1])), scales, weight))
        return -(costs[0] - costs[1]) / (4.0 * STEP)

    shared = np.array([slope(0, (k,)) for k in range(bundle.shared.count)])
    np.testing.assert_allclose(normal.shared_gradient, shared, atol=1e-3 * np.abs(shared).max())
    pose = 6  # the squat bends legs and arms
    own = np.array([slope(1, (pose, k)) for k in range(normal.pose_gradient.shape[1])])
    np.testing.assert_allclose(normal.pose_gradient[pose], own, atol=1e-3 * np.abs(own).max())


def test_expectations_against_differences(rng: np.random.Generator) -> None:
    bundle, at, scales = setting(rng)
    shared = bundle.shared
    _, slope = shared.prior_residuals(at, scales.mount_spread, scales.skin_offset_m)
    own = np.zeros((8, 6 + len(bundle.hinges)))
    for k in range(shared.count):
        step = STEP * np.eye(shared.count)[k]
        ahead, behind = (
            shared.prior_residuals(
                bundle.apply_step(at, (sign * step, own)), scales.mount_spread, scales.skin_offset_m
            )[0]
            for sign in (1.0, -1.0)
        )
        np.testing.assert_allclose(slope[:, k], (ahead - behind) / (2.0 * STEP), atol=1e-4 * np.abs(slope).max())


def whole(normal: NormalEquations) -> tuple[Floats, Floats]:
    """The full normal matrix and its right-hand side."""
    poses, own, shared = normal.coupling.shape
    matrix = np.zeros((shared + poses * own,) * 2)
    matrix[:shared, :shared] = normal.shared
    for p in range(poses):
        rows = slice(shared + p * own, shared + (p + 1) * own)
        matrix[rows, rows], matrix[rows, :shared] = normal.pose_blocks[p], normal.coupling[p]
        matrix[:shared, rows] = normal.coupling[p].T
    return matrix, np.concatenate([normal.shared_gradient, normal.pose_gradient.ravel()])


@pytest.mark.parametrize("damping", [0.0, 1e-3, 10.0])
def test_poses_are_eliminated_rightly(damping: float, rng: np.random.Generator) -> None:
    bundle, at, scales = setting(rng)
    normal = bundle.normal_equations(at, scales, np.ones((8, 6, 2)))
    matrix, right = whole(normal)
    expected = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), right)
    shared, own = normal.step(damping)
    np.testing.assert_allclose(np.concatenate([shared, own.ravel()]), expected, atol=1e-6 * np.abs(expected).max())


def test_variances_are_those_of_everything_at_once(rng: np.random.Generator) -> None:
    bundle, at, scales = setting(rng)
    normal = bundle.normal_equations(at, scales, np.ones((8, 6, 2)))
    everything = np.linalg.inv(whole(normal)[0])
    covariance, own = normal.variances()
    count = bundle.shared.count
    scale = np.sqrt(np.diag(everything)[:count])
    np.testing.assert_allclose(
        covariance / np.outer(scale, scale), everything[:count, :count] / np.outer(scale, scale), atol=1e-6
    )
    np.testing.assert_allclose(own.ravel(), np.diag(everything)[count:], rtol=1e-6)


def test_the_heading_between_points(rng: np.random.Generator) -> None:
    points = rng.normal(size=(6, 3))
    there = rotations.rotate(rotations.about_z(2.5), points) + np.array([1.0, 2.0, 3.0])
    assert heading_between_rad(points, there) == pytest.approx(2.5)


def test_directions_in_which_people_differ_by_less_than_a_micrometre_are_fixed() -> None:
    prior, mounts = space(), [DEFAULT_MOUNTS[station] for station in SIX]
    across_m = np.zeros_like(prior.across_m)
    fixed = SharedUnknowns(LIKE, replace(prior, across_m=across_m), mounts).count
    across_m[3] = 0.9e-6, 1.1e-6
    assert SharedUnknowns(LIKE, replace(prior, across_m=across_m), mounts).count == fixed + 1
