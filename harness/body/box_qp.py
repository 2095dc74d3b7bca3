"""Quadratic programs with bounds, solved by MuJoCo (projected Newton steps)."""

import mujoco
import numpy as np

from harness.core.arrays import Floats


class BoxQP:
    """Minimises 1/2 x^T H x + g^T x over low <= x <= high in n dimensions. For one thread only."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._factor = np.zeros((n, n + 7))

    def solve(self, hessian: Floats, gradient: Floats, low: Floats, high: Floats) -> Floats | None:
        """The minimiser x (n,) for H (n, n), of which the lower triangle is read, and g (n,).

        0 must lie within the bounds. Returns None unless H is numerically positive definite on the free directions.
        """
        x: Floats = np.zeros(self._n)
        rank = mujoco.mju_boxQP(x, self._factor, None, hessian, gradient, low, high)
        return x if rank >= 0 else None
