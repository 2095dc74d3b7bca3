"""The space of a local linear model: postures q = p + U w, and what leaving p costs (docs/methods.md C2).

The cost is alpha/2 (q - p)^T Lambda^-1 (q - p) plus beta/2 |q - q'|^2, both quadratic in q. So many directions are
kept that it is cheaper to name those that are not: q is sought among all postures, with a stiff spring across the
space, and every step is projected onto it (`descent.descend_within`).
"""

import numpy as np

from harness.core.arrays import Floats, Singles
from harness.core.compiled import compiled, specialise
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolution, Stopping
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.subspace_minimiser import Subspace, minimise_in_subspace

_VARIANCE_FLOOR = 1e-9
"""Added to all variances [m^2, rad^2]."""
_SPRING_STIFFNESS = 1e9
"""Of the spring across the space, far above what trackers say of a pose [1/m^2, 1/rad^2]."""
_INVERSE_ITERATION_MAX, _INVERSE_ITERATION_ROUNDS = 16, 4
"""Up to so many directions left out are found by so many rounds of inverse iteration, in an eighth of the time."""


class SubspaceSolver:
    """Solves for whatever frame its residuals have read, among the postures of a space."""

    def __init__(self, residuals: Residuals, limits: HingeLimits, stopping: Stopping) -> None:
        self._residuals, self._limits = residuals, limits
        self._arrays = residuals.tree, residuals.targets, residuals.state
        self._stop = stopping.step, stopping.decrease, stopping.most_steps
        any_space = fit_subspace(
            np.zeros((1, POSTURE_SIZE), np.float32), POSTURE_SIZE, 1.0, np.zeros(POSTURE_SIZE), 0.0
        )
        start = np.zeros(3 + POSTURE_SIZE)
        self._descend = specialise(minimise_in_subspace, *self._arrays, any_space, self._stop, start)

    def solve(self, space: Subspace, ground: Floats, posture: Floats) -> IKSolution:
        """From a ground frame (3,) and a posture (P,). What leaves the hinges' limits is clipped at the end."""
        start = np.concatenate([ground, posture])
        qpos, cost, steps, converged = self._descend(*self._arrays, space, self._stop, start)
        if steps < 0:
            raise ArithmeticError("normal equations are not positive definite: is a reading not finite?")
        qpos[7:] = self._limits.clip(qpos[7:])
        self._residuals.evaluate(qpos)
        return IKSolution(qpos, cost, steps, converged)


@compiled
def fit_subspace(postures: Singles, components: int, alpha: float, expected: Floats, beta: float) -> Subspace:
    """By the leading directions of K postures (K, P); `expected` (P,) is q'."""
    count, size = postures.shape
    values = postures.astype(np.float64)
    mean = np.dot(np.full(count, 1.0 / count), values)
    scatter = np.dot(values.T, values)
    for i in range(size):
        for j in range(size):
            scatter[i, j] = scatter[i, j] / count - mean[i] * mean[j]
        scatter[i, i] += _VARIANCE_FLOOR
    inverse, left_out = invert_positive_definite(scatter), max(size - components, 0)
    if left_out <= _INVERSE_ITERATION_MAX:
        across = least_variance_directions(inverse, left_out, _INVERSE_ITERATION_ROUNDS)
    else:
        across = np.ascontiguousarray(np.linalg.eigh(scatter)[1][:, :left_out].T)
    curvature = _constrained_curvature(inverse, across, alpha)
    spring = np.zeros(size)
    for i in range(size):
        curvature[i, i] += beta
        for k in range(left_out):
            spring[i] += _SPRING_STIFFNESS * across[k, i] ** 2
    return Subspace(mean, across, curvature, beta * (expected - mean), spring)


@compiled
def _constrained_curvature(inverse: Floats, across: Floats, alpha: float) -> Floats:
    """(P, P) alpha times the inverse within the space, and the spring across it."""
    share = alpha * np.dot(across, inverse)
    within = np.dot(share, across.T)
    for k in range(len(across)):
        within[k, k] += _SPRING_STIFFNESS
    half = np.dot(across.T, share - 0.5 * np.dot(within, across))
    out: Floats = alpha * inverse - half - half.T
    return out


@compiled
def invert_positive_definite(matrix: Floats) -> Floats:
    """The inverse of a positive definite matrix (N, N), by Gauss and Jordan's elimination of its lower triangle."""
    out, pivot, count = matrix.copy(), np.empty(len(matrix)), len(matrix)
    for k in range(count):
        pivot[: k + 1], pivot[k + 1 :] = out[k, : k + 1], out[k + 1 :, k]
        scale = 1.0 / pivot[k]
        for i in range(count):
            if i != k:
                row, share = out[i], pivot[i] * scale
                for j in range(i + 1):
                    row[j] -= share * pivot[j]
                if i > k:
                    row[k] = share
                else:
                    out[k, i] = share
        out[k, k] = -scale
    for i in range(count):
        for j in range(i + 1):
            out[i, j] = out[j, i] = -out[i, j]
    return out


@compiled
def least_variance_directions(inverse: Floats, count: int, rounds: int) -> Floats:
    """(D, N) orthonormal rows: the D = `count` directions of least variance, from the inverse (N, N) of the scatter.

    Inverse iteration of all at once, from the coordinates that the others leave the least room. Two directions whose
    variances are alike may come out mixed, which matters as little as which of them is left out.
    """
    out = inverse[np.argsort(-np.diag(inverse))[:count]]
    for turn in range(rounds + 1):
        if 0 < turn < rounds:
            out = np.dot(out, inverse)
        for i in range(count):  # Gram and Schmidt's method, at the end twice
            row = out[i]
            row /= np.sqrt(np.dot(row, row))
            shares = np.dot(out[i + 1 :], row)
            for j in range(i + 1, count):
                other, share = out[j], shares[j - i - 1]
                for k in range(len(row)):
                    other[k] -= share * row[k]
    return out
