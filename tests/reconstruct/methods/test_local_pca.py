"""Solving within a local linear model: gradients against finite differences, and the subspace."""

import math

import numpy as np
import pytest

from harness.core.arrays import Floats, Singles
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.methods.local_pca import LocalPca
from harness.reconstruct.solver.ground_frame import ground_from_qpos, posture_from_qpos, qpos_from_posture
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolution, Stopping
from harness.reconstruct.solver.matrix_algebra import factorise, invert_positive_definite, new_rows, solve_factorised
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.subspace import SubspaceSolver, fit_subspace
from harness.reconstruct.solver.subspace_minimiser import (
    Subspace,
    damp,
    descent_in_subspace,
    project_direction,
    project_posture,
    subspace_cost,
    to_subspace,
)
from tests.reconstruct.conftest import Scene, normal_equations_of, normal_rows_of


def postures_of(scene: Scene) -> Singles:
    out: Singles = MotionDatabase.build(scene.body, [scene.take]).posture[20:80]
    return out


def scatter_of(postures: Singles) -> Floats:
    away = postures - postures.mean(axis=0, dtype=float)
    out: Floats = away.T @ away / len(away)
    return out


def space_of(scene: Scene, components: int = 7) -> Subspace:
    return fit_subspace(postures_of(scene), components, 0.8, np.zeros(52), 0.0)


@pytest.mark.parametrize("lean_rad", [0.0, 1e-6, 1.2])
def test_normal_equations_against_differences(walk: Scene, rng: np.random.Generator, lean_rad: float) -> None:
    space = fit_subspace(postures_of(walk), 40, 0.8, posture_from_qpos(walk.take.qpos[33]), 20.0)
    residuals = Residuals(walk.body, walk.calibration, Loss(robust=False))
    residuals.read(walk.frames[30])
    z = np.concatenate([ground_from_qpos(walk.take.qpos[30]) + 0.05, space.mean + 0.1 * rng.normal(size=52)])
    z[4:7] = [0.6 * lean_rad, 0.8 * lean_rad, 0.0]

    def data_cost(z: Floats) -> float:
        return residuals.evaluate(qpos_from_posture(z[3:], z[:3]))

    h = 1e-6
    steps = h * np.eye(55)
    slopes = [
        residuals.kinematics.difference(
            qpos_from_posture((z - step)[3:], (z - step)[:3]), qpos_from_posture((z + step)[3:], (z + step)[:3])
        )
        for step in steps
    ]
    jacobian = np.array(slopes).T / (2.0 * h)
    gradient = np.array([(data_cost(z + step) - data_cost(z - step)) / (2.0 * h) for step in steps])
    gradient[3:] += space.curvature @ (z[3:] - space.mean) - space.linear
    data_cost(z)
    hessian, descent = normal_equations_of(residuals)
    expected = jacobian.T @ hessian @ jacobian
    expected[3:, 3:] += space.curvature
    normal, found = np.empty((55, 55)), np.empty(55)
    rows, tangent_descent = normal_rows_of(residuals)
    to_subspace(residuals.tree, space, z, rows, normal)
    descent_in_subspace(space, z, tangent_descent, found)
    np.testing.assert_allclose(np.tril(normal), np.tril(expected), rtol=1e-6, atol=1e-5 * np.abs(hessian).max())
    np.testing.assert_allclose(-found, gradient, rtol=1e-6, atol=1e-5 * np.abs(descent).max())


def test_undamped_steps_solve_the_normal_equations_within_the_space(walk: Scene, rng: np.random.Generator) -> None:
    space = space_of(walk, 40)
    basis = np.eye(55)
    basis[3:, 3:] -= space.normals.T @ space.normals
    half = rng.normal(size=(55, 55))
    normal, gradient = half @ half.T + np.eye(55), rng.normal(size=55)
    normal[3:, 3:] += space.curvature
    within = np.linalg.svd(basis)[0][:, :43]
    step = within @ np.linalg.solve(within.T @ normal @ within, within.T @ gradient)
    factor, found = new_rows(55), gradient.copy()
    factor[:, :55] = np.tril(normal)
    damp(space, factor, 0.0)
    assert factorise(factor)
    solve_factorised(factor, found)
    found[3:] = project_direction(space, found[3:])
    np.testing.assert_allclose(found, step, atol=2e-3 * np.abs(step).max())


def test_damping_raises_the_diagonal_but_not_the_spring(walk: Scene) -> None:
    space = space_of(walk, 40)
    normal = np.diag(np.concatenate([np.ones(3), 2.0 + space.spring]))
    damp(space, normal, 0.5)
    expected = np.concatenate([np.full(3, 1.5), 3.0 + space.spring])
    np.testing.assert_allclose(np.diag(normal), expected, rtol=1e-6)


def test_what_is_left_out_varies_least(walk: Scene) -> None:
    """Directions by inverse iteration are orthonormal and hold hardly more variance than the least eigenvalues."""
    space, scatter = space_of(walk, 40), scatter_of(postures_of(walk))
    np.testing.assert_allclose(space.normals @ space.normals.T, np.eye(12), atol=1e-10)
    held = np.trace(space.normals @ scatter @ space.normals.T)
    assert held <= 1.01 * np.sum(np.linalg.eigvalsh(scatter)[:12]) + 12 * 1e-9


@pytest.mark.parametrize("count", [1, 2, 3, 8, 52, 55])
def test_inverse(count: int, rng: np.random.Generator) -> None:
    half = rng.normal(size=(60, count)) * np.geomspace(1.0, 1e-4, count)
    product = half.T @ half
    np.testing.assert_allclose(invert_positive_definite(product) @ product, np.eye(count), atol=1e-6)


def test_costs_are_those_of_c2(walk: Scene, rng: np.random.Generator) -> None:
    """The cost is alpha/2 (q - p)^T Lambda^-1 (q - p) + beta/2 |q - expected|^2 up to a constant."""
    postures, expected = postures_of(walk), posture_from_qpos(walk.take.qpos[33])
    space, scatter = fit_subspace(postures, 7, 0.8, expected, 3.0), scatter_of(postures)

    def written_out(q: Floats) -> float:
        within = q - space.mean
        return float(0.4 * within @ np.linalg.pinv(scatter, rcond=1e-9) @ within + 1.5 * np.sum((q - expected) ** 2))

    assert subspace_cost(space, space.mean) == 0.0
    for direction in 0.2 * rng.normal(size=(5, 52)):
        q = project_posture(space, space.mean + direction)
        np.testing.assert_allclose(subspace_cost(space, q), written_out(q) - written_out(space.mean), rtol=1e-6)


def test_the_answer_lies_in_the_subspace_and_is_a_minimum(walk: Scene, rng: np.random.Generator) -> None:
    space, residuals = space_of(walk), Residuals(walk.body, walk.calibration, Loss())
    residuals.read(walk.frames[50])
    ground, limits = ground_from_qpos(walk.take.qpos[50]), HingeLimits(walk.body, keep=False)
    found = SubspaceSolver(residuals, limits, Stopping(step=1e-7, decrease=0.0)).solve(space, ground + 0.05, space.mean)
    posture, ground = posture_from_qpos(found.qpos), ground_from_qpos(found.qpos)
    np.testing.assert_allclose(project_posture(space, posture), posture, atol=1e-9)
    for step in 1e-3 * rng.normal(size=(20, 55)):
        there = project_posture(space, posture + step[3:])
        assert (
            residuals.evaluate(qpos_from_posture(there, ground + step[:3])) + subspace_cost(space, there)
            > found.cost - 1e-9
        )


def test_few_directions_follow_trackers_worse_than_many(walk: Scene, boxing: Scene) -> None:
    off_m = []
    for components in (3, 40):
        fitted = LocalPca(components=components, widening=0.0).fit(walk.body, walk.examples, np.random.default_rng(0))
        session = fitted.begin(walk.calibration)
        estimates = [session.step(frame) for frame in walk.frames]
        off_m.append(walk.off_m(estimates, walk.take.qpos)[20:].mean())
    assert off_m[1] < 0.7 * off_m[0]


def test_the_smoothness_term_asks_for_constant_velocity(walk: Scene) -> None:
    """C2: |q_t - 2 q_t-1 + q_t-2|^2. Where it outweighs all else, the answer continues the last step."""
    method = LocalPca(
        components=52, prior_weight=1e-9, smooth_weight=1e9, smooth_sigma_rad=1.0, widening=0.0, jump_m=math.inf
    )
    session = method.fit(walk.body, walk.examples, np.random.default_rng(0)).begin(walk.calibration)
    for frame in walk.frames[:20]:
        session.step(frame)
    # the step into the frames that are compared is 3 times as long as the true one
    session.past[0, 7:] = walk.take.qpos[19, 7:]
    session.past[1, 7:] = session.past[0, 7:] - 3.0 * (walk.take.qpos[19, 7:] - walk.take.qpos[18, 7:])
    expected = 2.0 * session.past[0, 7:] - session.past[1, 7:]
    session.residuals.read(walk.frames[20])
    found = session.solve_next().qpos[7:]
    np.testing.assert_allclose(found, expected, atol=1e-3)
    assert np.abs(expected - walk.take.qpos[20, 7:]).max() > 0.05


def test_the_smoothness_term_is_in_units_of_a_typical_change(walk: Scene) -> None:
    """beta / sigma^2: ten times the typical change needs a hundred times the weight."""

    def answers(smooth_weight: float, smooth_sigma_rad: float) -> Floats:
        method = LocalPca(smooth_weight=smooth_weight, smooth_sigma_rad=smooth_sigma_rad)
        return np.array([estimate.qpos for estimate in walk.run(method, walk.frames[:30])])

    np.testing.assert_allclose(answers(0.2, 0.1), answers(20.0, 1.0), atol=1e-9)
    assert np.abs(answers(0.2, 0.1) - answers(2.0, 1.0)).max() > 1e-6


def test_the_predicted_decrease_ends_a_solve_early_and_hardly_elsewhere(walk: Scene) -> None:
    space = space_of(walk, 52)
    residuals = Residuals(walk.body, walk.calibration, Loss())
    limits, early = HingeLimits(walk.body), 0
    for index in range(20, 40):
        residuals.read(walk.frames[index])
        ground, posture = ground_from_qpos(walk.take.qpos[index - 2]), posture_from_qpos(walk.take.qpos[index - 2])

        def solve(stopping: Stopping, ground: Floats = ground, posture: Floats = posture) -> IKSolution:
            return SubspaceSolver(residuals, limits, stopping).solve(space, ground, posture)

        usual, exact = solve(Stopping(step=0.0)), solve(Stopping(1e-7, 1e-13))
        before = solve(Stopping(step=0.0, most_steps=usual.steps - 1))
        assert usual.converged
        assert usual.cost - exact.cost < 3e-5
        np.testing.assert_allclose(usual.qpos, exact.qpos, atol=1e-3)
        early += before.cost - usual.cost > Stopping().decrease
    assert early > 5, "solves that ended while the cost still fell by more"


def test_a_result_is_within_the_limits_and_evaluated(walk: Scene) -> None:
    residuals, limits = Residuals(walk.body, walk.calibration, Loss()), HingeLimits(walk.body)
    residuals.read(walk.frames[30])
    posture = posture_from_qpos(walk.take.qpos[30])
    hinge = int(np.flatnonzero(np.isfinite(limits.low_rad))[0])
    limits.low_rad[hinge] = posture[4 + hinge] + 0.02
    limits.high_rad[hinge] = posture[4 + hinge] + 0.03
    solution = SubspaceSolver(residuals, limits, Stopping()).solve(
        space_of(walk, 52), ground_from_qpos(walk.take.qpos[30]), posture
    )
    assert limits.low_rad[hinge] <= solution.qpos[7 + hinge] <= limits.high_rad[hinge]
    evaluated = residuals.state.error.copy()
    residuals.evaluate(solution.qpos)
    np.testing.assert_array_equal(evaluated, residuals.state.error)
