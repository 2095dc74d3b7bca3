"""Minima within the limits."""

import numpy as np
import pytest

from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.testing.frames import drop_stations
from tests.reconstruct.conftest import Scene


def precision(sigma_rad: float) -> np.ndarray:
    out = np.zeros(54)
    out[6:] = sigma_rad**-2
    return out


@pytest.mark.parametrize("robust", [False, True])
def test_ends_where_no_lawful_step_lowers_the_cost(walk: Scene, rng: np.random.Generator, robust: bool) -> None:
    residuals, limits = Residuals(walk.body, walk.calibration, Loss(robust=robust)), HingeLimits(walk.body)
    solver = IKSolver(residuals, limits, Stopping(step=1e-7, decrease=0.0, most_steps=200))
    prior = Prior(walk.take.qpos[30], precision(0.5))
    start = np.array(walk.take.qpos[30])
    start[7:] += rng.normal(0.0, 0.2, 48)
    residuals.read(walk.frames[40])
    solution = solver.solve(start, prior)
    assert solution.converged

    def cost(step: np.ndarray) -> float:
        moved = residuals.kinematics.integrate(solution.qpos, step)
        moved[7:] = limits.clip(moved[7:])
        away = residuals.kinematics.difference(moved, prior.qpos)
        return residuals.evaluate(moved) + 0.5 * float(precision(0.5) @ (away * away))

    least = cost(np.zeros(54))
    for _ in range(200):
        assert cost(1e-3 * rng.normal(size=54)) >= least - 1e-9


def test_limits_hold_even_where_the_prior_lies_beyond(walk: Scene) -> None:
    limits = HingeLimits(walk.body)
    knee = 7 + [walk.body.model.joint(1 + d).name for d in range(48)].index("ltibia.rx")
    residuals = Residuals(walk.body, walk.calibration, Loss())
    residuals.read(drop_stations(walk.frames[0], range(6)))
    impossible = np.array(walk.take.qpos[0])
    impossible[knee] = limits.low_rad[knee - 7] - 0.5
    prior = Prior(impossible, precision(0.5))
    kept, loose = (
        IKSolver(residuals, known, Stopping(step=1e-7, decrease=0.0)).solve(walk.take.qpos[0], prior).qpos
        for known in (limits, HingeLimits(walk.body, keep=False))
    )
    assert kept[knee] == pytest.approx(limits.low_rad[knee - 7], abs=1e-9)
    assert loose[knee] == pytest.approx(impossible[knee], abs=1e-3)


def test_without_prior_six_trackers_are_met_exactly(walk: Scene) -> None:
    residuals, limits = Residuals(walk.body, walk.calibration, Loss(robust=False)), HingeLimits(walk.body)
    solver = IKSolver(residuals, limits, Stopping())
    residuals.read(walk.frames[44])
    solution = solver.solve(walk.take.qpos[40], Prior(walk.take.qpos[40], None))
    assert solution.converged
    assert residuals.evaluate(solution.qpos) < 1e-4


def test_a_solve_leaves_no_trace(walk: Scene) -> None:
    residuals, limits = Residuals(walk.body, walk.calibration, Loss()), HingeLimits(walk.body)
    solver, prior = IKSolver(residuals, limits, Stopping()), Prior(walk.take.qpos[10], precision(0.5))
    residuals.read(walk.frames[12])
    once = solver.solve(walk.take.qpos[10], prior).qpos
    residuals.read(walk.frames[90])
    solver.solve(walk.take.qpos[20], prior)
    residuals.read(walk.frames[12])
    np.testing.assert_array_equal(solver.solve(walk.take.qpos[10], prior).qpos, once)


@pytest.mark.parametrize(("off_m", "taken"), [(0.003, True), (0.3, False)])
def test_a_converged_step_is_taken_only_when_it_is_short(walk: Scene, off_m: float, taken: bool) -> None:
    """With a tolerance that every step meets, a step below 1 cm is still taken, and a longer one is not."""
    residuals, limits = Residuals(walk.body, walk.calibration, Loss(robust=False)), HingeLimits(walk.body)
    solver = IKSolver(residuals, limits, Stopping(step=10.0))
    truth = walk.take.qpos[30]
    start = np.array(truth)
    start[0] += off_m
    residuals.read(walk.frames[30])
    solution = solver.solve(start, Prior(truth, precision(0.5)))
    assert (solution.converged, solution.steps) == (True, 1)
    assert abs(solution.qpos[0] - truth[0]) == pytest.approx(0.0 if taken else off_m, abs=1e-4)
