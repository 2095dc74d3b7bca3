"""Quadratic programs with bounds, by MuJoCo's own solver (projected Newton steps)."""

import mujoco
import numpy as np

from harness.core.arrays import Floats


class BoxQP:
    """Minimises 1/2 x^T H x + g^T x over low <= x <= high in n dimensions. Not for sharing between threads."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._factor = np.zeros((n, n + 7))

    def solve(self, hessian: Floats, gradient: Floats, low: Floats, high: Floats) -> Floats | None:
        """x (n,) for H (n, n), of which the lower triangle is read, and g (n,); 0 must lie within the bounds.

        None unless H is positive definite, to rounding, on the directions that the bounds leave free.
        """
        x: Floats = np.zeros(self._n)
        rank = mujoco.mju_boxQP(x, self._factor, None, hessian, gradient, low, high)
        return x if rank >= 0 else None
