"""Levenberg and Marquardt's method among the poses of a local linear model.

Unknown are the ground frame (x, y, yaw) and a posture q = p + U w. Minimised is the data cost plus
alpha/2 (q - p)^T Lambda^-1 (q - p) plus beta/2 |q - q'|^2 (docs/methods.md C2), both quadratic in q. So many
directions are kept that it is cheaper to name those that are not: q is sought among all postures, with a stiff spring
across the space, and every step is projected onto it.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.reconstruct import descent
from harness.reconstruct.footing import stood
from harness.reconstruct.hinges import HingeLimits
from harness.reconstruct.residuals import Residuals
from harness.reconstruct.solver import Solution, Stopping

_DAMPING, _RAISE, _LOWER = 1e-3, 10.0, 3.0
_LEAST = 1e-6
"""Keeps a step of 0 where nothing was read about the ground frame."""
_FLOOR = 1e-9
"""Added to all variances [m^2, rad^2]."""
_STIFF = 1e9
"""Of the spring across the space, far above what trackers say of a pose [1/m^2, 1/rad^2]."""
_FEW, _ROUNDS = 16, 4
"""Up to so many directions left out are found by so many rounds of inverse iteration, in an eighth of the time."""


class Subspace(NamedTuple):
    """Postures near p that differ from it by nothing along N, with a quadratic cost 1/2 a^T A a - b^T a, a = q - p."""

    mean: Floats
    """(52,) p."""
    across: Floats
    """(52 - B, 52) N, orthonormal: what U leaves out."""
    curvature: Floats
    """(52, 52) A, and the spring across the space."""
    pull: Floats
    """(52,) b."""
    spring: Floats
    """(52,) what of the diagonal of A is the spring's."""

    @classmethod
    def of(cls, postures: Floats, components: int, weight: float) -> "Subspace":
        """The leading directions of K postures (K, 52), and alpha = `weight` times a^T Lambda^-1 a."""
        mean = np.full(len(postures), 1.0 / len(postures)) @ postures
        scatter = postures.T @ postures / len(postures) - np.outer(mean, mean)
        scatter.reshape(-1)[:: len(mean) + 1] += _FLOOR
        inverse, left_out = inverted(scatter), max(len(mean) - components, 0)
        if left_out <= _FEW:
            across = least(inverse, left_out, _ROUNDS)
        else:
            across = np.ascontiguousarray(np.linalg.eigh(scatter)[1][:, :left_out].T)
        spring = _STIFF * (across * across).sum(axis=0)
        return cls(mean, across, _confined(inverse, across, weight), np.zeros(len(mean)), spring)

    def smoothed(self, expected: Floats, weight: float) -> "Subspace":
        """With beta = `weight` times the squared distance from a posture (52,) added."""
        curvature = np.array(self.curvature)
        curvature.reshape(-1)[:: len(self.pull) + 1] += weight
        return self._replace(curvature=curvature, pull=self.pull + weight * (expected - self.mean))

    def nearest(self, posture: Floats) -> Floats:
        """The posture (52,) of the space that is nearest to one."""
        out: Floats = posture - (self.across @ (posture - self.mean)) @ self.across
        return out

    def cost(self, posture: Floats) -> float:
        away = posture - self.mean
        return float(away @ (0.5 * (self.curvature @ away) - self.pull))


def solve(
    residuals: Residuals, limits: HingeLimits, space: Subspace, ground: Floats, posture: Floats, stopping: Stopping
) -> Solution:
    """Downhill from a ground frame (3,) and a posture (52,). What leaves the hinges' limits is clipped at the end."""
    z = np.concatenate([ground, space.nearest(posture)])
    hessian, descending, gradient, normal = np.zeros((54, 54)), np.empty(54), np.empty(55), np.empty((55, 55))
    qpos = stood(z[3:], z[:3])
    cost, damping, converged, steps = residuals.place(qpos) + space.cost(z[3:]), _DAMPING, False, 0
    while not converged and steps < stopping.most_steps:
        steps += 1
        descent.normal_equations(residuals.chain, residuals.placed, hessian, descending)
        refer(space, z, hessian, descending, normal, gradient)
        while True:
            step = damped(space, normal, gradient, damping)
            longest = max(float(step.max()), -float(step.min()))
            there = z + step
            moved = stood(there[3:], there[:3])
            new_cost = residuals.place(moved) + space.cost(there[3:])
            if new_cost <= cost or longest < stopping.step:
                break
            damping *= _RAISE
        converged = longest < stopping.step or cost - new_cost < stopping.decrease
        if new_cost <= cost:
            z, qpos, cost, damping = there, moved, new_cost, damping / _LOWER
    qpos = np.concatenate([qpos[:7], limits.clipped(qpos[7:])])
    residuals.place(qpos)
    return Solution(qpos, cost, steps, converged)


@compiled
def inverted(matrix: Floats) -> Floats:
    """The inverse of a positive definite matrix (N, N), by Gauss and Jordan's elimination."""
    out, count = matrix.copy(), len(matrix)
    for k in range(count):
        row = out[k] / out[k, k]
        row[k] = 1.0 / out[k, k]
        for i in range(count):
            if i != k:
                share = out[i, k]
                out[i, k] = 0.0
                for j in range(count):
                    out[i, j] -= share * row[j]
        out[k] = row
    return out


@compiled
def least(inverse: Floats, count: int, rounds: int) -> Floats:
    """(D, N) orthonormal rows: the D = `count` directions of least variance, from the inverse (N, N) of the scatter.

    Inverse iteration of all at once, from the coordinates that the others leave the least room. Two directions whose
    variances are alike may come out mixed, which matters as little as which of them is left out.
    """
    out = inverse[np.argsort(-np.diag(inverse))[:count]]
    for turn in range(rounds + 1):
        if 0 < turn < rounds:
            out = np.dot(out, inverse)
        for i in range(count):  # Gram and Schmidt's method, at the end twice
            out[i] /= np.sqrt(np.dot(out[i], out[i]))
            for j in range(i + 1, count):
                share = np.dot(out[j], out[i])
                for k in range(out.shape[1]):
                    out[j, k] -= share * out[i, k]
    return out


def _confined(inverse: Floats, across: Floats, weight: float) -> Floats:
    """(N, N) `weight` times the inverse within the space, and the spring across it."""
    share = weight * (across @ inverse)
    within = share @ across.T
    within.reshape(-1)[:: len(across) + 1] += _STIFF
    half = across.T @ (share - 0.5 * within @ across)
    out: Floats = weight * inverse - half - half.T
    return out


@compiled
def root_slope(z: Floats) -> Floats:
    """(6, 7) how the root moves and turns as the ground frame, height and tilt do.

    Its turn is about_z(yaw) exp(tilt): in the root's own axes yaw turns about exp(-tilt) z, and tilt by its right
    Jacobian.
    """
    x, y, up = z[4], z[5], z[6]
    cross = np.array([[0.0, -up, y], [up, 0.0, -x], [-y, x, 0.0]])
    squared = x * x + y * y + up * up
    angle = np.sqrt(squared)
    half, sine, rest = 0.5, 1.0, 1.0 / 6.0
    if angle > 1e-4:
        half = (1.0 - np.cos(angle)) / squared
        sine, rest = np.sin(angle) / angle, (angle - np.sin(angle)) / (squared * angle)
    twice = np.dot(cross, cross)
    out = np.zeros((6, 7))
    out[0, 0] = out[1, 1] = out[2, 3] = out[5, 2] = 1.0
    out[3:, 2] += half * twice[:, 2] - sine * cross[:, 2]
    out[3:, 4:] = np.eye(3) - half * cross + rest * twice
    return out


@compiled
def refer(space: Subspace, z: Floats, hessian: Floats, descent: Floats, normal: Floats, gradient: Floats) -> None:
    """Makes normal equations (55, 55), in the upper triangle, and descent (55,) of z from those of the solver's
    directions (54, 54), in the lower triangle, and (54,). Hinges are the same in both. The prior is added."""
    slope = root_slope(z)
    for r in range(48):
        for c in range(r + 1):
            normal[7 + c, 7 + r] = hessian[6 + r, 6 + c]
    for a in range(7):
        for r in range(48):
            normal[a, 7 + r] = 0.0
            for k in range(6):
                normal[a, 7 + r] += slope[k, a] * hessian[6 + r, k]
        for b in range(a, 7):
            normal[a, b] = 0.0
            for k in range(6):
                for m in range(6):
                    normal[a, b] += slope[k, a] * hessian[max(k, m), min(k, m)] * slope[m, b]
        gradient[a] = 0.0
        for k in range(6):
            gradient[a] += slope[k, a] * descent[k]
    gradient[7:] = descent[6:]
    gradient[3:] += space.pull - np.dot(space.curvature, z[3:] - space.mean)
    normal[3:, 3:] += space.curvature


def damped(space: Subspace, normal: Floats, gradient: Floats, damping: float) -> Floats:
    """Levenberg and Marquardt's step (55,) within the space; the matrix from its upper triangle."""
    matrix = normal.copy()
    diagonal = matrix.reshape(-1)[:: len(matrix) + 1]
    diagonal[3:] -= space.spring * (damping / (1.0 + damping))  # the spring is not damped
    diagonal *= 1.0 + damping
    diagonal += _LEAST
    _, step, failed = lapack.dposv(matrix.T, gradient, lower=1, overwrite_a=1)
    if failed or not np.isfinite(step[0]):
        raise ArithmeticError("normal equations are not positive definite: is a reading not finite?")
    step[3:] -= (space.across @ step[3:]) @ space.across
    out: Floats = step
    return out
