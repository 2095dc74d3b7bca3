"""The subspace of a local linear model: postures q = p + U w, and the cost of leaving p (docs/papers.md C2).

The cost is alpha/2 (q - p)^T Lambda^-1 (q - p) plus beta/2 |q - q'|^2, both quadratic in q. Most directions are kept,
so it is cheaper to store the normals, the directions that are not. The solver works with all of q: a stiff spring acts
along the normals, and every step is projected onto the subspace (`subspace_minimiser`).
"""

import numpy as np

from harness.core.arrays import Floats, Singles
from harness.core.compiled import compiled, specialise
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolution, Stopping
from harness.reconstruct.solver.matrix_algebra import invert_positive_definite
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.subspace_minimiser import Subspace, minimise_in_subspace

_VARIANCE_FLOOR = 1e-9
"""Added to all variances [m^2, rad^2]."""
_SPRING_STIFFNESS = 1e9
"""Stiffness of the spring along the normals, far above the precision of trackers [1/m^2, 1/rad^2]."""
_INVERSE_ITERATION_MAX, _INVERSE_ITERATION_ROUNDS = 16, 4
"""Up to this many normals are found by this many rounds of inverse iteration, in an eighth of the time of `eigh`."""


class SubspaceSolver:
    """Solves for the frame that its residuals have read, among the postures of a subspace."""

    def __init__(self, residuals: Residuals, limits: HingeLimits, stopping: Stopping) -> None:
        self._arrays = residuals.tree, residuals.targets, residuals.state
        self._end = (limits.low_rad, limits.high_rad), (stopping.step, stopping.decrease, stopping.most_steps)
        nothing, none = np.zeros(POSTURE_SIZE), np.zeros((0, POSTURE_SIZE))
        example = Subspace(nothing, none, np.eye(POSTURE_SIZE), nothing, nothing)
        start = np.zeros(3 + POSTURE_SIZE)
        self._minimise = specialise(minimise_in_subspace, *self._arrays, example, *self._end, start)

    def solve(self, subspace: Subspace, ground: Floats, posture: Floats) -> IKSolution:
        """The minimum from a start: ground frame (3,) and posture (P,). Hinges are clipped to their limits at the end.

        ArithmeticError when a reading is not finite.
        """
        start = np.concatenate([ground, posture])
        qpos, cost, steps, converged = self._minimise(*self._arrays, subspace, *self._end, start)
        if steps < 0:
            raise ArithmeticError("The normal equations are not positive definite: is a reading not finite?")
        return IKSolution(qpos, cost, steps, converged)


@compiled
def fit_subspace(postures: Singles, components: int, alpha: float, expected: Floats, beta: float) -> Subspace:
    """The subspace of the `components` leading principal directions of K postures (K, P); `expected` (P,) is q'."""
    count, size = postures.shape
    values = postures.astype(np.float64)
    mean = np.dot(np.full(count, 1.0 / count), values)
    scatter = np.dot(values.T, values)
    for i in range(size):
        for j in range(size):
            scatter[i, j] = scatter[i, j] / count - mean[i] * mean[j]
        scatter[i, i] += _VARIANCE_FLOOR
    inverse, count_normals = invert_positive_definite(scatter), max(size - components, 0)
    if count_normals <= _INVERSE_ITERATION_MAX:
        normals = least_variance_directions(inverse, count_normals, _INVERSE_ITERATION_ROUNDS)
    else:
        normals = np.ascontiguousarray(np.linalg.eigh(scatter)[1][:, :count_normals].T)
    curvature = _constrained_curvature(inverse, normals, alpha)
    spring = np.zeros(size)
    for i in range(size):
        curvature[i, i] += beta
        for k in range(count_normals):
            spring[i] += _SPRING_STIFFNESS * normals[k, i] ** 2
    return Subspace(mean, normals, curvature, beta * (expected - mean), spring)


@compiled
def gaussian_space(
    mean: Floats, covariance: Floats, hinge_mean: Floats, hinge_precision: Floats, hinge_weight: float
) -> Subspace:
    """All postures, at the cost of two Gaussian priors: mean (P,) and covariance (P, P); and one of the hinges alone.

    The second has a mean and precisions (48,) and counts `hinge_weight` times. Rows and columns of the first beyond the
    posture are left out.
    """
    linear, first = np.zeros(POSTURE_SIZE), POSTURE_SIZE - len(hinge_mean)
    posture, curvature = mean[:POSTURE_SIZE], invert_positive_definite(covariance[:POSTURE_SIZE, :POSTURE_SIZE])
    for i in range(len(hinge_mean)):
        precision = hinge_weight * hinge_precision[i]
        curvature[first + i, first + i] += precision
        linear[first + i] = precision * (hinge_mean[i] - posture[first + i])
    return Subspace(posture, np.zeros((0, POSTURE_SIZE)), curvature, linear, np.zeros(POSTURE_SIZE))


@compiled
def _constrained_curvature(inverse: Floats, normals: Floats, alpha: float) -> Floats:
    """(P, P) alpha times the inverse scatter within the subspace, and the spring along its normals N (D, P).

    With S the inverse: P alpha S P + k N^T N, where P = I - N^T N is the projection.
    """
    share = alpha * np.dot(normals, inverse)
    within = np.dot(share, normals.T)  # alpha N S N^T, then with the spring
    for k in range(len(normals)):
        within[k, k] += _SPRING_STIFFNESS
    half = np.dot(normals.T, share - 0.5 * np.dot(within, normals))
    out: Floats = alpha * inverse - half - half.T
    return out


@compiled
def least_variance_directions(inverse: Floats, count: int, rounds: int) -> Floats:
    """(D, N) orthonormal rows: the D = `count` directions of least variance, from the inverse (N, N) of the scatter.

    Inverse iteration of all directions at once. It starts from the coordinates with the least conditional variance.
    Directions of nearly equal variance may come out mixed, which does no harm.
    """
    out = inverse[np.argsort(-np.diag(inverse))[:count]]
    for iteration in range(rounds + 1):
        if 0 < iteration < rounds:
            out = np.dot(out, inverse)
        for i in range(count):  # Gram-Schmidt, twice at the end
            row = out[i]
            row /= np.sqrt(np.dot(row, row))
            shares = np.dot(out[i + 1 :], row)
            for j in range(i + 1, count):
                other, share = out[j], shares[j - i - 1]
                for k in range(len(row)):
                    other[k] -= share * row[k]
    return out
