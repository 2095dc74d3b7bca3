"""Quadratic programs with bounds, against their optimality conditions."""

import numpy as np
import pytest

from harness.body.box_qp import BoxQP


@pytest.mark.parametrize("half_width", [np.inf, 1.0, 0.05])
def test_the_answer_is_optimal(rng: np.random.Generator, half_width: float) -> None:
    program = BoxQP(54)
    for _ in range(20):
        rows, gradient = rng.normal(size=(60, 54)), 10.0 * rng.normal(size=54)
        hessian = rows.T @ rows
        low, high = -half_width * rng.random(54), half_width * rng.random(54)
        x = program.solve(np.tril(hessian), gradient, low, high)
        assert x is not None
        assert np.all((low <= x) & (x <= high))
        slope = hessian @ x + gradient
        inside = (x > low + 1e-12) & (x < high - 1e-12)
        assert np.max(np.abs(slope[inside]), initial=0.0) < 1e-6
        assert np.all(slope[x <= low + 1e-12] > -1e-6)
        assert np.all(slope[x >= high - 1e-12] < 1e-6)


def test_no_minimum_no_answer() -> None:
    hessian = np.diag([1.0, -1.0, 1.0])
    assert BoxQP(3).solve(hessian, np.ones(3), np.full(3, -np.inf), np.full(3, np.inf)) is None
