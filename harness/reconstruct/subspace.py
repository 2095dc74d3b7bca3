"""Levenberg and Marquardt's method among the poses of a local linear model.

Unknown are the ground frame (x, y, yaw) and the weights w of q = p + U w, a posture. Minimised is the data cost plus
alpha/2 (q - p)^T Lambda^-1 (q - p) plus beta/2 |q - 2 q' + q''|^2 (docs/methods.md C2), both quadratic in w.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lapack

from harness.core.arrays import Floats
from harness.reconstruct import descent
from harness.reconstruct.database.ground import HEIGHT, HINGES, TILT
from harness.reconstruct.footing import stood
from harness.reconstruct.hinges import HingeLimits
from harness.reconstruct.residuals import Residuals
from harness.reconstruct.solver import Solution, Stopping

_DAMPING, _RAISE, _LOWER = 1e-3, 10.0, 3.0
_LEAST = 1e-6
"""Keeps a step of 0 where nothing was read about the ground frame."""


@dataclass(frozen=True, eq=False)
class Subspace:
    """Postures p + U w with a quadratic cost 1/2 w^T A w - b^T w."""

    mean: Floats
    """(52,) p."""
    axes: Floats
    """(52, B) U."""
    curvature: Floats
    """(B, B) A."""
    pull: Floats
    """(B,) b."""

    @classmethod
    def of(cls, postures: Floats, components: int, weight: float) -> "Subspace":
        """The leading directions of K postures (K, 52), and alpha = `weight` times w^T Lambda^-1 w."""
        mean = postures.mean(axis=0)
        away = postures - mean
        values, axes = np.linalg.eigh(away.T @ away / len(away))
        values, axes = values[-components:], np.ascontiguousarray(axes[:, -components:])
        curvature = np.diag(weight / np.maximum(values, 1e-9))
        return cls(mean, axes, curvature, np.zeros(len(values)))

    def smoothed(self, expected: Floats, weight: float) -> "Subspace":
        """With beta = `weight` times the squared distance from a posture (52,) added."""
        curvature = self.curvature + weight * np.eye(len(self.pull))
        return replace(self, curvature=curvature, pull=self.pull + weight * (self.axes.T @ (expected - self.mean)))

    def nearest(self, posture: Floats) -> Floats:
        """w (B,) of the posture of the space that is nearest to one (52,)."""
        out: Floats = self.axes.T @ (posture - self.mean)
        return out

    def cost(self, w: Floats) -> float:
        return float(0.5 * w @ self.curvature @ w - self.pull @ w)


def solve(
    residuals: Residuals, limits: HingeLimits, space: Subspace, ground: Floats, w: Floats, stopping: Stopping
) -> Solution:
    """Downhill from a ground frame (3,) and weights (B,). What leaves the hinges' limits is clipped at the end."""
    z = np.concatenate([ground, w])
    hessian, descending, own = np.zeros((54, 54)), np.empty(54), np.zeros((len(z), len(z)))
    own[3:, 3:] = space.curvature
    qpos, slope = posed(space, z), empty_tangent(space)
    cost, damping, converged, steps = residuals.place(qpos) + space.cost(w), _DAMPING, False, 0
    while not converged and steps < stopping.most_steps:
        steps += 1
        fill_tangent(space, z, slope)
        descent.normal_equations(residuals.chain, residuals.placed, hessian, descending)  # the lower triangle
        hessian.reshape(-1)[::55] *= 0.5
        normal = slope.T @ (hessian @ slope)
        normal += normal.T + own
        gradient = descending @ slope
        gradient[3:] += space.pull - space.curvature @ z[3:]
        diagonal = normal.diagonal().copy()
        while True:
            normal.reshape(-1)[:: len(z) + 1] = diagonal * (1.0 + damping) + _LEAST
            _, step, _ = lapack.dposv(normal, gradient, lower=1)
            longest = max(float(step.max()), -float(step.min()))
            moved = posed(space, z + step)
            new_cost = residuals.place(moved) + space.cost((z + step)[3:])
            if new_cost <= cost or longest < stopping.step:
                break
            damping *= _RAISE
        converged = longest < stopping.step or cost - new_cost < stopping.decrease
        if new_cost <= cost:
            z, qpos, cost, damping = z + step, moved, new_cost, damping / _LOWER
    qpos = np.concatenate([qpos[:7], limits.clipped(qpos[7:])])
    residuals.place(qpos)
    return Solution(qpos, cost, steps, converged)


def posed(space: Subspace, z: Floats) -> Floats:
    """The configuration (55,) of a ground frame and weights (3 + B,)."""
    out: Floats = stood(space.mean + space.axes @ z[3:], z[:3])
    return out


def empty_tangent(space: Subspace) -> Floats:
    """(54, 3 + B) what of `tangent` is the same everywhere."""
    out = np.zeros((54, 3 + len(space.pull)))
    out[0, 0] = out[1, 1] = 1.0
    out[2, 3:], out[6:, 3:] = space.axes[HEIGHT], space.axes[HINGES]
    return out


def tangent(space: Subspace, z: Floats) -> Floats:
    """(54, 3 + B) how the solver's directions follow the unknowns: J U but for the kinematics."""
    out = empty_tangent(space)
    fill_tangent(space, z, out)
    return out


def fill_tangent(space: Subspace, z: Floats, out: Floats) -> None:
    """The rest of it.

    The root's turn is about_z(yaw) exp(tilt): in the root's own axes yaw turns about exp(-tilt) z, and tilt by its
    right Jacobian.
    """
    tilt = space.mean[TILT] + space.axes[TILT] @ z[3:]
    x, y, up = tilt.tolist()
    cross = np.array([[0.0, -up, y], [up, 0.0, -x], [-y, x, 0.0]])
    twice, squared = cross @ cross, x * x + y * y + up * up
    angle = math.sqrt(squared)
    half, sine, rest = 0.5, 1.0, 1.0 / 6.0
    if angle > 1e-4:
        half = (1.0 - math.cos(angle)) / squared
        sine, rest = math.sin(angle) / angle, (angle - math.sin(angle)) / (squared * angle)
    out[3:6, 2] = _UP - sine * cross[:, 2] + half * twice[:, 2]
    out[3:6, 3:] = (_SAME - half * cross + rest * twice) @ space.axes[TILT]


_UP, _SAME = np.array([0.0, 0.0, 1.0]), np.eye(3)
