"""Eq. 1 of Liu et al. 2011 as printed, against the truth, against its own text, and where poses are missed."""

from dataclasses import replace

import numpy as np
import pytest

from harness.calibrate.hold import UnusableHold
from harness.calibrate.liu2011_calibration import (
    Liu2011Calibration,
    Liu2011Constants,
    PrintedObjective,
    calibrate_liu2011,
)
from harness.calibrate.pose_calibration import calibrate_poses, measure_poses, pose_bundle
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.skeleton import Skeleton
from harness.errors import BadInput
from tests.calibrate.standing_model import Model, somebody, space

WEIGHTS_M: Floats = np.array([1.0, -0.8, 0.5, 1.2, -1.0]) * space().mode_sd_m


def in_the_span() -> Skeleton:
    """A person whose bones are the mean plus modes, and point as the mean skeleton's: what eq. 1 can represent."""
    length_m = space().mean_m + WEIGHTS_M @ space().modes
    return standard_skeleton().with_bones(length_m[:, None] * space().direction)


def mount_errors(found: Liu2011Calibration, model: Model) -> tuple[Floats, Floats]:
    """(S,) errors of the mounts [m, rad]."""
    known, truth = found.calibration, model.truth
    return (
        np.linalg.norm(known.mount_m - truth.mount_m, axis=1),
        rotations.angle_between_rad(known.bone_from_station, truth.bone_from_station),
    )


@pytest.mark.parametrize("constants", [Liu2011Constants(), Liu2011Constants(tolerance=1e-12, alpha_2=0.1)])
def test_poses_held_exactly_give_the_truth(constants: Liu2011Constants) -> None:
    """Without noise: lengths, weights, mounts and room, also of bones that no tracker sees, through the modes."""
    model = Model(in_the_span(), beside_m=0.015)
    found = calibrate_liu2011(model.held(), space(), model.mounts, constants)
    np.testing.assert_allclose(found.skeleton.length_m, model.skeleton.length_m, atol=1e-7)
    np.testing.assert_allclose(found.weights_m, WEIGHTS_M, atol=1e-7)
    off_m, off_rad = mount_errors(found, model)
    assert off_m.max() < 1e-7
    assert off_rad.max() < 1e-7
    assert rotations.angle_between_rad(found.calibration.world_from_tracker, model.truth.world_from_tracker) < 1e-7
    np.testing.assert_allclose(found.calibration.tracker_origin_m, model.truth.tracker_origin_m, atol=1e-6)
    assert found.cost < 1e-12
    assert found.calibration.kind == "liu2011"


def test_missed_poses_show_as_bias() -> None:
    """The equation has no term for a miss. A miss of 2.5 deg costs more than ours, on average over performers."""
    errors = []
    for number in range(3):
        model = Model(somebody(number), miss_rad=np.deg2rad(2.5), beside_m=0.015, seed=number)
        held = model.held()
        printed = calibrate_liu2011(held, space(), model.mounts)
        ours = calibrate_poses(held, space(), model.mounts)
        rows = [np.linalg.norm(c.calibration.mount_m - model.truth.mount_m, axis=1).mean() for c in (printed, ours)]
        errors.append([*rows, np.rad2deg(mount_errors(printed, model)[1]).mean()])
    printed_m, ours_m, printed_deg = np.mean(errors, axis=0)
    assert printed_m > 1.2 * ours_m
    assert 1.0 < printed_deg < 6.0


def test_the_minimum_is_hardly_determined_by_missed_poses() -> None:
    """Run to its minimum, the equation turns a miss of half a degree into decimetres of bone: why it stops early."""
    model = Model(in_the_span(), miss_rad=np.deg2rad(0.5), beside_m=0.015)
    held = model.held()
    stopped = calibrate_liu2011(held, space(), model.mounts)
    assert np.abs(stopped.skeleton.length_m - model.skeleton.length_m).max() < 0.05
    bundle = pose_bundle(measure_poses(held, model.mounts), space(), model.mounts)
    objective = PrintedObjective(bundle, Liu2011Constants(tolerance=1e-12))
    at, cost = objective.minimise()
    assert cost < stopped.cost
    assert np.abs(objective.signed_length_m(at) - model.skeleton.length_m).max() > 0.1


def test_the_objective_is_the_printed_sum(rng: np.random.Generator) -> None:
    """Position, alpha_1 times orientation and alpha_2 times skeleton, summed by hand over readings moved by hand."""
    model, constants = Model(in_the_span(), beside_m=0.01), Liu2011Constants(alpha_1=0.3, alpha_2=7.0, tolerance=1e-12)
    bundle = pose_bundle(measure_poses(model.held(), model.mounts), space(), model.mounts)
    at, _ = PrintedObjective(bundle, constants).minimise()
    moved_m, turned_rad = 0.01 * rng.normal(size=(8, 6, 3)), 0.05 * rng.normal(size=(8, 6, 3))
    bundle.place_m = bundle.place_m + moved_m
    bundle.turn = rotations.to_matrix(rotations.exp(turned_rad)) @ bundle.turn
    beyond_m = 0.002 * rng.normal(size=5)
    objective = PrintedObjective(bundle, constants)
    residuals = objective.residuals(replace(at, weights_m=at.weights_m + beyond_m))
    # The modes are orthonormal, so the last term is the square of what was added to the weights.
    expected = np.sum(moved_m**2) + 0.3 * np.sum(turned_rad**2) + 7.0 * np.sum(beyond_m**2)
    assert residuals @ residuals == pytest.approx(expected, rel=1e-5)


def test_the_jacobian_against_differences(rng: np.random.Generator) -> None:
    model = Model(in_the_span(), beside_m=0.01)
    bundle = pose_bundle(measure_poses(model.held(), model.mounts), space(), model.mounts)
    objective = PrintedObjective(bundle, Liu2011Constants(tolerance=1e-12))
    at, _ = objective.minimise()
    slope = objective.jacobian(at)
    for k in rng.choice(slope.shape[1], 30, replace=False):
        step = 1e-6 * np.eye(slope.shape[1])[k]
        ahead, behind = (objective.residuals(objective.apply_step(at, sign * step)) for sign in (1.0, -1.0))
        np.testing.assert_allclose(slope[:, k], (ahead - behind) / 2e-6, atol=1e-6)


def test_a_skeleton_that_cannot_be_is_refused() -> None:
    """One pose in place of all eight determines no bone."""
    model = Model(somebody(0), miss_rad=np.deg2rad(10.0), seed=2)
    never = Liu2011Constants(damping=1e-6, tolerance=1e-9)
    with pytest.raises(UnusableHold, match=r"Eq. 1 gives the bone .* a length of -\d+ mm"):
        calibrate_liu2011(model.held(), space(), model.mounts, never)
    with pytest.raises(BadInput, match="7 poses were held"):
        calibrate_liu2011(model.held()[:7], space(), model.mounts)
