"""Terms of contact against numpy: positions by the body's kinematics, slopes by differences."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import pose_from_qpos
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.reconstruct.solver.floor_contact import FEET, FloorContact
from harness.reconstruct.solver.ground_frame import (
    HINGES,
    ground_from_qpos,
    posture_from_qpos,
    qpos_from_postures,
)
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.subspace_minimiser import Subspace
from harness.testing.frames import exact_calibration, exact_frames
from tests.reconstruct.conftest import Scene

RATE_HZ = 40.0
STEP_M, FREE_STEP_M, DEPTH_SIGMA_M, DEPTH_SCALE_M = 0.4 / RATE_HZ, 1.2 / RATE_HZ, 0.02, 0.1
"""The constants as the documentation states them."""
FEET_IN_QPOS = [47, 48, 53, 54]
"""Angles of the left and the right foot: outermost first, the last of each leg."""
GROUND = np.array([0.3, -0.2, 0.7])
"""A ground frame that differs from the true one: measured shins do not need it."""
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
    found = contact.constrain(prior, GROUND, history)
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
    after[7:] = contact.constrain(prior, GROUND, True).mean[HINGES]
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
    shift = contact.constrain(prior, GROUND, True).mean - prior.mean
    assert 0.0 < np.abs(shift).max() < 0.01


def expected_free(
    scene: Scene, prior: Subspace, ground: Floats, last_m: Floats | None, floor_m: float
) -> tuple[Floats, Floats]:
    """Mean (52,) and curvature (52, 52) by numpy, for toes that no shin shows."""

    def toes_at(posture: Floats) -> Floats:
        return toes_m(scene, qpos_from_postures(posture, ground))

    at, step = toes_at(prior.mean), 1e-6
    slopes = np.stack(
        [(toes_at(prior.mean + step * e) - toes_at(prior.mean - step * e)) / (2 * step) for e in np.eye(52)], axis=-1
    )  # (2, 3, 52)
    curvature, pull = np.array(prior.curvature), np.zeros(52)
    for foot, slope in enumerate(slopes):
        if last_m is not None:
            away = last_m[foot] - at[foot]
            weight = (1.0 + away @ away / FREE_STEP_M**2) ** -2 / FREE_STEP_M**2
            curvature += weight * slope.T @ slope
            pull += weight * slope.T @ away
        depth = floor_m - at[foot, 2]
        if depth > 0.0:
            weight = (1.0 + (depth / DEPTH_SCALE_M) ** 2) ** -2 / DEPTH_SIGMA_M**2
            curvature += weight * np.outer(slope[2], slope[2])
            pull += weight * slope[2] * depth
    return prior.mean + np.linalg.solve(curvature, pull), curvature


def with_stations(scene: Scene, *stations: str) -> Scene:
    calibration: Calibration = exact_calibration(scene.body, stations)
    return replace(scene, calibration=calibration, frames=exact_frames(scene.body, calibration, scene.take.qpos[:32]))


@pytest.mark.parametrize("floor_m", [LOW_M, 0.06])
@pytest.mark.parametrize("history", [True, False])
def test_the_terms_of_free_feet_are_those_of_numpy(
    walk: Scene, floor_m: float, history: bool, rng: np.random.Generator
) -> None:
    scene, index = with_stations(walk, "left_wrist", "right_wrist", "head"), 30
    _, contact = read(scene, index, floor_m)
    posture = posture_from_qpos(walk.take.qpos[index]) + 0.02 * rng.normal(size=52)
    prior, ground = planted(posture, rng), ground_from_qpos(walk.take.qpos[index]) + 0.01
    last_m = toes_m(walk, walk.take.qpos[index - 1]) if history else None
    mean, curvature = expected_free(scene, prior, ground, last_m, floor_m)
    found = contact.constrain(prior, ground, history)
    np.testing.assert_allclose(found.mean, mean, atol=1e-7)
    np.testing.assert_allclose(found.curvature, curvature, rtol=1e-5, atol=1e-2)
    assert history is bool(np.abs(found.mean - prior.mean).max() > 0.0) or floor_m > LOW_M


@pytest.mark.parametrize("kind", [0, 1])
def test_a_shin_that_is_not_measured_in_full_leaves_its_foot_free(
    walk: Scene, kind: int, rng: np.random.Generator
) -> None:
    """Its toe is where the answer before put it."""
    stations = walk.calibration.stations
    drop = np.zeros(2 * len(stations), bool)
    for name in ("left_ankle", "right_ankle"):
        drop[kind * len(stations) + stations.index(name)] = True
    _, contact = read(walk, 30, 0.06, drop)
    prior, ground = planted(posture_from_qpos(walk.take.qpos[30]), rng), ground_from_qpos(walk.take.qpos[30])
    mean, _ = expected_free(walk, prior, ground, toes_m(walk, walk.take.qpos[29]), 0.06)
    np.testing.assert_allclose(contact.constrain(prior, ground, True).mean, mean, atol=1e-7)


def test_two_stations_bind_no_free_foot(walk: Scene, rng: np.random.Generator) -> None:
    """Neither in this frame nor in the next one."""
    _, contact = read(with_stations(walk, "left_wrist", "head"), 2, HIGH_M)
    prior = planted(posture_from_qpos(walk.take.qpos[2]), rng)
    np.testing.assert_array_equal(contact.constrain(prior, GROUND, True).curvature, prior.curvature)
    contact.record(walk.take.qpos[2])
    assert np.isnan(contact._last_m).all()
