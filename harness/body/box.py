"""Quadratic programs with bounds, by MuJoCo's own solver: projected Newton steps, warm-started."""

import mujoco
import numpy as np

from harness.core.arrays import Floats


class BoxQP:
    """Minimises 1/2 x^T H x - g^T x over low <= x <= high in n dimensions. Not for sharing between threads."""

    def __init__(self, n: int) -> None:
        self._factor = np.zeros((n, n + 7))
        self._guess = np.zeros(n)

    def solve(self, hessian: Floats, descent: Floats, low: Floats, high: Floats) -> Floats | None:
        """x (n,) for H (n, n), symmetric, and g (n,); None unless H is positive definite to rounding."""
        x: Floats = np.clip(self._guess, low, high)
        if mujoco.mju_boxQP(x, self._factor, None, hessian, -descent, low, high) < 0:
            return None
        return x
