"""Solving within a local linear model: slopes against differences, and confinement."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.database.ground import ground_of, posture_of
from harness.reconstruct.hinges import HingeLimits
from harness.reconstruct.local_pca import LocalPca
from harness.reconstruct.residuals import Loss, Residuals
from harness.reconstruct.solver import Stopping
from harness.reconstruct.subspace import Subspace, posed, solve, tangent

from .conftest import Scene


def space_of(scene: Scene, components: int = 7) -> Subspace:
    postures = MotionDatabase.build(scene.body, [scene.take]).posture[20:80].astype(float)
    return Subspace.of(postures, components, 0.8)


@pytest.mark.parametrize("lean_rad", [0.0, 1e-6, 1.2])
def test_tangent_against_differences(walk: Scene, rng: np.random.Generator, lean_rad: float) -> None:
    space, residuals = space_of(walk), Residuals(walk.body, walk.calibration, Loss())
    mean = np.array(space.mean)
    mean[1:4] = [0.6 * lean_rad, 0.8 * lean_rad, 0.0]
    space = Subspace(mean, space.axes, space.curvature, space.pull)
    z = np.concatenate([[0.3, -0.2, 2.0], np.zeros(7)])
    slopes, h = tangent(space, z), 1e-6
    for k, step in enumerate(h * np.eye(10)):
        away = residuals.kinematics.difference(posed(space, z - step), posed(space, z + step)) / (2.0 * h)
        np.testing.assert_allclose(slopes[:, k], away, atol=2e-6)


def test_gradient_against_central_differences(walk: Scene, rng: np.random.Generator) -> None:
    space = space_of(walk).smoothed(posture_of(walk.take.qpos[33]), 20.0)
    residuals = Residuals(walk.body, walk.calibration, Loss())
    residuals.read(walk.frames[30])
    z = np.concatenate([ground_of(walk.take.qpos[30]) + 0.05, 0.1 * rng.normal(size=7)])

    def cost(z: Floats) -> float:
        return residuals.place(posed(space, z)) + space.cost(z[3:])

    h = 1e-6
    slopes = np.array([(cost(z + step) - cost(z - step)) / (2.0 * h) for step in h * np.eye(10)])
    cost(z)
    gradient = -residuals.normal_equations(np.zeros((54, 54))) @ tangent(space, z)
    gradient[3:] += space.curvature @ z[3:] - space.pull
    np.testing.assert_allclose(gradient, slopes, atol=1e-5 * np.abs(slopes).max())


def test_costs_are_those_of_c2(walk: Scene, rng: np.random.Generator) -> None:
    """Up to a constant: alpha/2 (q - p)^T Lambda^-1 (q - p) and beta/2 |q - expected|^2, written out."""
    postures = MotionDatabase.build(walk.body, [walk.take]).posture[20:80].astype(float)
    expected = posture_of(walk.take.qpos[33])
    space = Subspace.of(postures, 7, 0.8).smoothed(expected, 3.0)
    away = postures - postures.mean(axis=0)
    scatter = away.T @ away / len(away)

    def written_out(w: Floats) -> float:
        q = space.mean + space.axes @ w
        within = q - space.mean
        return float(0.4 * within @ np.linalg.pinv(scatter, rcond=1e-9) @ within + 1.5 * np.sum((q - expected) ** 2))

    for w in 0.2 * rng.normal(size=(5, 7)):
        np.testing.assert_allclose(
            space.cost(w) - space.cost(np.zeros(7)), written_out(w) - written_out(np.zeros(7)), rtol=1e-6
        )


def test_the_answer_lies_in_the_subspace_and_is_a_minimum(walk: Scene, rng: np.random.Generator) -> None:
    space, residuals = space_of(walk), Residuals(walk.body, walk.calibration, Loss())
    residuals.read(walk.frames[50])
    ground, limits = ground_of(walk.take.qpos[50]), HingeLimits(walk.body, keep=False)
    found = solve(residuals, limits, space, ground + 0.05, np.zeros(7), Stopping(step=1e-7, decrease=0.0))
    away = posture_of(found.qpos) - space.mean
    np.testing.assert_allclose(space.axes @ (space.axes.T @ away), away, atol=1e-9)
    z = np.concatenate([ground_of(found.qpos), space.nearest(posture_of(found.qpos))])
    for step in 1e-3 * rng.normal(size=(20, 10)):
        assert residuals.place(posed(space, z + step)) + space.cost((z + step)[3:]) > found.cost - 1e-9


def test_few_directions_follow_trackers_worse_than_many(walk: Scene, boxing: Scene) -> None:
    off_m = []
    for components in (3, 40):
        fitted = LocalPca(components=components).fit(walk.body, [walk.take], np.random.default_rng(0))
        session = fitted.begin(walk.calibration)
        estimates = [session.step(frame) for frame in walk.frames]
        off_m.append(walk.off_m(estimates, walk.take.qpos)[20:].mean())
    assert off_m[1] < 0.5 * off_m[0]
