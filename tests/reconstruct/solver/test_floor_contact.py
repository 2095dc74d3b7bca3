"""Terms of contact against numpy: positions by the body's kinematics, slopes by differences."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import pose_from_qpos
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.reconstruct.solver.floor_contact import FEET, FloorContact
from harness.reconstruct.solver.ground_frame import HINGES, posture_from_qpos
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.subspace_minimiser import Subspace
from harness.testing.frames import exact_calibration, exact_frames
from tests.reconstruct.conftest import Scene

RATE_HZ = 40.0
STEP_M, DEPTH_SIGMA_M, DEPTH_SCALE_M = 0.4 / RATE_HZ, 0.02, 0.1
"""The constants as the documentation states them."""
FEET_IN_QPOS = [47, 48, 53, 54]
"""Angles of the left and the right foot: outermost first, the last of each leg."""
LOW_M, HIGH_M = -10.0, 0.5
"""A floor far below and one far above the toes."""


def toes_m(scene: Scene, qpos: Floats) -> Floats:
    """(2, 3) far ends of the feet."""
    skeleton = scene.body.skeleton
    out: Floats = pose_from_qpos(skeleton, qpos[None]).end_m[0, [skeleton.index(foot) for foot in FEET]]
    return out


def with_feet(qpos: Floats, by_rad: Floats) -> Floats:
    out = np.array(qpos)
    out[FEET_IN_QPOS] += by_rad
    return out


def planted(mean: Floats, rng: np.random.Generator) -> Subspace:
    root = rng.normal(size=(52, 80))
    curvature = np.asarray(np.linalg.inv(0.01 * root @ root.T / 80.0 + 1e-4 * np.eye(52)), dtype=np.float64)
    return Subspace(mean, np.zeros((0, 52)), curvature, np.zeros(52), np.zeros(52))


def read(scene: Scene, index: int, contact_floor_m: float, drop: Bools | None = None) -> tuple[Residuals, FloorContact]:
    """Residuals that have read a frame, and contact that has recorded the true pose of the frame before."""
    residuals = Residuals(scene.body, scene.calibration, Loss())
    contact = FloorContact(scene.body, residuals, contact_floor_m, RATE_HZ)
    residuals.read(scene.frames[index - 1])
    contact.record(scene.take.qpos[index - 1])
    residuals.read(scene.frames[index])
    if drop is not None:
        residuals.leave_out(drop)
    return residuals, contact


def expected(
    scene: Scene, prior: Subspace, qpos: Floats, last_m: Floats | None, floor_m: float
) -> tuple[Floats, Floats]:
    """Mean (52,) and curvature (52, 52) by numpy; `qpos` has the true shins and the feet of the prior's mean."""
    at, step = toes_m(scene, qpos), 1e-6
    slopes = np.stack(
        [
            (toes_m(scene, with_feet(qpos, step * e)) - toes_m(scene, with_feet(qpos, -step * e))) / (2 * step)
            for e in np.eye(4)
        ],
        axis=-1,
    )  # (2, 3, 4)
    curvature, pull = np.array(prior.curvature), np.zeros(52)
    where = np.array(FEET_IN_QPOS) - 3
    for foot in range(2):
        slope = slopes[foot]
        if last_m is not None:
            away = last_m[foot] - at[foot]
            weight = (1.0 + away @ away / STEP_M**2) ** -2 / STEP_M**2
            curvature[np.ix_(where, where)] += weight * slope.T @ slope
            pull[where] += weight * slope.T @ away
        depth = floor_m - at[foot, 2]
        if depth > 0.0:
            weight = (1.0 + (depth / DEPTH_SCALE_M) ** 2) ** -2 / DEPTH_SIGMA_M**2
            curvature[np.ix_(where, where)] += weight * np.outer(slope[2], slope[2])
            pull[where] += weight * slope[2] * depth
    return prior.mean + np.linalg.solve(curvature, pull), curvature


@pytest.mark.parametrize("floor_m", [LOW_M, 0.06, HIGH_M])
@pytest.mark.parametrize("history", [True, False])
def test_the_terms_are_those_of_numpy(walk: Scene, floor_m: float, history: bool, rng: np.random.Generator) -> None:
    index, turn = 30, np.array([0.05, -0.1, 0.15, 0.2])
    _, contact = read(walk, index, floor_m)
    qpos = with_feet(walk.take.qpos[index], turn)
    elsewhere = posture_from_qpos(qpos)
    elsewhere[:4] += 0.1  # only the feet of the mean count: the shins are measured
    elsewhere[4:20] += 0.1
    prior = planted(elsewhere, rng)
    last_m = toes_m(walk, walk.take.qpos[index - 1]) if history else None
    mean, curvature = expected(walk, prior, qpos, last_m, floor_m)
    found = contact.constrain(prior, history)
    np.testing.assert_allclose(found.mean, mean, atol=1e-8)
    np.testing.assert_allclose(found.curvature, curvature, rtol=1e-6, atol=1e-3)
    np.testing.assert_array_equal(found.linear, 0.0)


def test_a_toe_in_stance_is_held(walk: Scene, rng: np.random.Generator) -> None:
    """The stiller toe ends nearer to where it was; the prior itself is not changed."""
    index = 30
    moved = np.linalg.norm(toes_m(walk, walk.take.qpos[index]) - toes_m(walk, walk.take.qpos[index - 1]), axis=1)
    still = int(np.argmin(moved))
    assert moved[still] < 0.2 * STEP_M
    _, contact = read(walk, index, LOW_M)
    wrong = with_feet(walk.take.qpos[index], np.full(4, 0.05))
    prior = planted(posture_from_qpos(wrong), rng)
    before = prior.mean.copy()
    after = np.array(wrong)
    after[7:] = contact.constrain(prior, True).mean[HINGES]
    last = toes_m(walk, walk.take.qpos[index - 1])[still]
    feet_only = np.array(wrong)
    feet_only[FEET_IN_QPOS] = after[FEET_IN_QPOS]
    off = [np.linalg.norm(toes_m(walk, q)[still] - last) for q in (wrong, feet_only)]
    assert off[1] < 0.7 * off[0]
    np.testing.assert_array_equal(prior.mean, before)


def test_a_fast_toe_is_free(walk: Scene, rng: np.random.Generator) -> None:
    """Five frames are missing, in which both toes move by more than the scale."""
    _, contact = read(walk, 30, LOW_M)
    prior = planted(posture_from_qpos(with_feet(walk.take.qpos[30], np.full(4, 1.2))), rng)
    shift = contact.constrain(prior, True).mean - prior.mean
    assert 0.0 < np.abs(shift).max() < 0.01


@pytest.mark.parametrize("kind", [0, 1])
def test_a_shin_that_is_not_measured_in_full_has_no_contact(walk: Scene, kind: int, rng: np.random.Generator) -> None:
    """Neither for this frame nor for the one after it."""
    stations = walk.calibration.stations
    drop = np.zeros(2 * len(stations), bool)
    for name in ("left_ankle", "right_ankle"):
        drop[kind * len(stations) + stations.index(name)] = True
    residuals, contact = read(walk, 30, HIGH_M, drop)
    prior = planted(posture_from_qpos(walk.take.qpos[30]), rng)
    np.testing.assert_array_equal(contact.constrain(prior, True).mean, prior.mean)
    contact.record(walk.take.qpos[30])
    residuals.read(walk.frames[31])
    np.testing.assert_array_equal(contact.constrain(prior, True).mean, contact.constrain(prior, False).mean)


def test_stations_elsewhere_have_no_contact(walk: Scene, rng: np.random.Generator) -> None:
    calibration: Calibration = exact_calibration(walk.body, ("left_wrist", "head"))
    frames = exact_frames(walk.body, calibration, walk.take.qpos[:3])
    other = replace(walk, calibration=calibration, frames=frames)
    _, contact = read(other, 2, HIGH_M)
    prior = planted(posture_from_qpos(walk.take.qpos[2]), rng)
    np.testing.assert_array_equal(contact.constrain(prior, True).curvature, prior.curvature)
