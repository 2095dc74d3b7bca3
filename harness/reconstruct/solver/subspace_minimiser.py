"""The Levenberg-Marquardt method among the postures of a linear subspace, compiled; see `subspace`.

The unknowns z (3 + P,) are a ground frame (x, y, yaw) and a posture: height, tilt (rotation vector) and hinges.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.reconstruct.solver.ground_frame import qpos_from_posture
from harness.reconstruct.solver.kinematic_tree import KinematicState, KinematicTree
from harness.reconstruct.solver.levenberg_marquardt import DAMPING_DECREASE, DAMPING_INCREASE
from harness.reconstruct.solver.matrix_algebra import dot
from harness.reconstruct.solver.normal_equations import StationTargets, evaluate, normal_rows


class Subspace(NamedTuple):
    """Postures (P,) near p that differ from it by nothing along the normals N; `subspace.fit_subspace` makes it.

    A difference a from p costs 1/2 a^T A a - b^T a.
    """

    mean: Floats
    """(P,) p."""
    normals: Floats
    """(D, P) N, orthonormal rows."""
    curvature: Floats
    """(P, P) A, with a stiff spring along N."""
    linear: Floats
    """(P,) b."""
    spring: Floats
    """(P,) the spring's part of the diagonal of A."""


_INITIAL_DAMPING = 1e-3
"""Relative to the diagonal, unlike that of `levenberg_marquardt`, which is added to it."""
_MAX_EXTRAPOLATED_STEP = 2e-3
"""After a step with no larger component [m, rad] the next decrease is predicted: decreases shrink geometrically."""
_MIN_DIAGONAL = 1e-6
"""Keeps the step at 0 for a ground frame that no reading determines."""


@compiled
def minimise_in_subspace(
    tree: KinematicTree,
    targets: StationTargets,
    state: KinematicState,
    subspace: Subspace,
    limits_rad: tuple[Floats, Floats],
    stop: tuple[float, float, int],
    z: Floats,
) -> tuple[Floats, float, int, bool]:
    """The posture of a subspace, and its ground frame, of least cost, from a start z (3 + P,).

    `limits_rad` are the hinges' low and high limits, to which the result is clipped. `stop` is step, decrease, and most
    steps (`ik_solver.Stopping`). Returns the configuration (V + 1,), which is evaluated last, its cost before it is
    clipped, the number of steps, and whether it converged; -1 steps as `levenberg_marquardt.minimise`.
    """
    qpos, cost, steps, converged = _minimise(tree, targets, state, subspace, stop, z)
    for i in range(7, len(qpos)):
        qpos[i] = min(max(qpos[i], limits_rad[0][i - 7]), limits_rad[1][i - 7])
    evaluate(tree, targets, state, qpos)
    return qpos, cost, steps, converged


@compiled
def _minimise(
    tree: KinematicTree,
    targets: StationTargets,
    state: KinematicState,
    subspace: Subspace,
    stop: tuple[float, float, int],
    z: Floats,
) -> tuple[Floats, float, int, bool]:
    """`minimise_in_subspace` before the limits."""
    rows, descent = np.empty(tree.ancestors.shape), np.empty(len(tree.depth))
    normal, z_descent = np.empty((len(z), len(z))), np.empty(len(z))
    z[3:] = project_posture(subspace, z[3:])
    qpos = qpos_from_posture(z[3:], z[:3])
    cost = evaluate(tree, targets, state, qpos) + subspace_cost(subspace, z[3:])
    damping, last_decrease = _INITIAL_DAMPING, np.nan  # no comparison with NaN is true
    for steps in range(1, stop[2] + 1):
        normal_rows(tree, state, rows, descent)
        to_subspace(tree, subspace, z, rows, descent, normal, z_descent)
        while True:  # raise the damping until a step lowers the cost or is too short to matter
            step = solve_damped(subspace, normal, z_descent, damping)
            longest = np.abs(step).max()
            if not np.isfinite(longest):
                return qpos, cost, -1, False
            next_z = z + step
            next_qpos = qpos_from_posture(next_z[3:], next_z[:3])
            next_cost = evaluate(tree, targets, state, next_qpos) + subspace_cost(subspace, next_z[3:])
            if next_cost <= cost or longest < stop[0]:
                break
            damping *= DAMPING_INCREASE
        decrease = cost - next_cost
        predicted = decrease * decrease / last_decrease if longest < _MAX_EXTRAPOLATED_STEP else np.inf
        converged = longest < stop[0] or decrease < stop[1] or predicted < stop[1]
        last_decrease = decrease
        if next_cost <= cost:
            z, qpos, cost, damping = next_z, next_qpos, next_cost, damping / DAMPING_DECREASE
        if converged:
            return qpos, cost, steps, True
    return qpos, cost, stop[2], False


@compiled
def project_posture(subspace: Subspace, posture: Floats) -> Floats:
    """The posture (P,) of the subspace that is nearest to a posture (P,)."""
    out: Floats = posture - np.dot(np.dot(subspace.normals, posture - subspace.mean), subspace.normals)
    return out


@compiled
def subspace_cost(subspace: Subspace, posture: Floats) -> float:
    """The cost of a posture (P,) beside that of the readings."""
    offset = posture - subspace.mean
    return dot(offset, 0.5 * np.dot(subspace.curvature, offset) - subspace.linear)


@compiled
def _root_jacobian(z: Floats) -> Floats:
    """(4, 3) the root's angular velocity, in its own axes, for yaw and the three components of tilt.

    The root's orientation is about_z(yaw) exp(tilt): yaw rotates it about exp(-tilt) z, and tilt by its right Jacobian.
    """
    x, y, up = z[4], z[5], z[6]
    squared = x * x + y * y + up * up
    angle = np.sqrt(squared)
    half, sine, rest = 0.5, 1.0, 1.0 / 6.0  # limits at angle 0
    if angle > 1e-4:
        half = (1.0 - np.cos(angle)) / squared
        sine, rest = np.sin(angle) / angle, (angle - np.sin(angle)) / (squared * angle)
    cross = np.array([[0.0, -up, y], [up, 0.0, -x], [-y, x, 0.0]])
    cross_squared = np.dot(cross, cross)
    out = np.empty((4, 3))
    out[0] = half * cross_squared[2] + sine * cross[2]
    out[0, 2] += 1.0
    out[1:] = np.eye(3) + half * cross + rest * cross_squared
    return out


@compiled
def to_subspace(
    tree: KinematicTree,
    subspace: Subspace,
    z: Floats,
    rows: Floats,
    descent: Floats,
    normal: Floats,
    z_descent: Floats,
) -> None:
    """Fill in the normal equations (3 + P, 3 + P), lower triangle, and the descent of z, from those of the tangent.

    Those are rows (V, D) and descent (V,) of `normal_rows`. The subspace's cost is added. Tangent: translation 0 to 2,
    root rotation 3 to 5, hinges from 6. Of z: x, y 0 and 1, yaw 2, height 3, tilt 4 to 6, hinges from 7. Hinges are the
    same in both, so only the seven leading rows and the columns of the root are transformed, by the Jacobian of the
    root's motion (7, 6). The root's directions are the first six ancestors of every hinge.
    """
    jacobian, root, rotation = np.zeros((7, 6)), np.empty((6, 6)), _root_jacobian(z)
    curvature = subspace.curvature
    jacobian[0, 0] = jacobian[1, 1] = jacobian[3, 2] = 1.0
    jacobian[2, 3:], jacobian[4:, 3:] = rotation[0], rotation[1:]
    for k in range(6):
        for m in range(k + 1):
            root[k, m] = root[m, k] = rows[k, m]
    normal[:7, :7] = np.dot(np.dot(jacobian, root), jacobian.T)
    normal[3:7, 3:7] += curvature[:4, :4]
    for r in range(6, len(rows)):
        row, tangent, prior = normal[r + 1], rows[r], curvature[r - 2]
        row[0], row[1], row[3] = tangent[0], tangent[1], tangent[2] + prior[0]
        row[2] = rotation[0, 0] * tangent[3] + rotation[0, 1] * tangent[4] + rotation[0, 2] * tangent[5]
        for k in range(1, 4):
            row[3 + k] = (
                rotation[k, 0] * tangent[3] + rotation[k, 1] * tangent[4] + rotation[k, 2] * tangent[5] + prior[k]
            )
        for c in range(6, r + 1):
            row[c + 1] = prior[c - 2]
        for d in range(6, tree.depth[r] + 1):
            row[tree.ancestors[r, d] + 1] += tangent[d]
    z_descent[:7] = np.dot(jacobian, descent[:6])
    z_descent[7:] = descent[6:]
    z_descent[3:] += subspace.linear - np.dot(curvature, z[3:] - subspace.mean)


@compiled
def solve_damped(subspace: Subspace, normal: Floats, descent: Floats, damping: float) -> Floats:
    """The damped step (3 + P,) within the subspace; NaN when the matrix is not positive definite."""
    factor, step = normal.copy(), descent.copy()
    count = len(step)
    for k in range(count):
        if k >= 3:
            factor[k, k] -= subspace.spring[k - 3] * (damping / (1.0 + damping))  # the spring is not damped
        factor[k, k] = factor[k, k] * (1.0 + damping) + _MIN_DIAGONAL
    for k in range(count - 1, -1, -1):  # L^T D L from the last row, as `levenberg_marquardt`, but of a dense matrix
        pivot = factor[k]
        if not pivot[k] > 0.0:
            step[:] = np.nan
            return step
        for i in range(k):
            share, row = pivot[i] / pivot[k], factor[i]
            for j in range(i + 1):
                row[j] -= share * pivot[j]
            step[i] -= share * step[k]
    for k in range(count):
        for i in range(k):
            step[k] -= factor[k, i] * step[i]
        step[k] /= factor[k, k]
    step[3:] -= np.dot(np.dot(subspace.normals, step[3:]), subspace.normals)
    return step
