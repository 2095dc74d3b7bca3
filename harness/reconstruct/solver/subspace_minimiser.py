"""The Levenberg-Marquardt method among the postures of a linear subspace, compiled; see `subspace`.

The unknowns z (3 + P,) are a ground frame (x, y, yaw) and a posture: height, tilt (rotation vector) and hinges.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.reconstruct.solver.ground_frame import qpos_from_posture
from harness.reconstruct.solver.kinematic_tree import KinematicState, KinematicTree
from harness.reconstruct.solver.levenberg_marquardt import DAMPING_INCREASE
from harness.reconstruct.solver.matrix_algebra import dot, factorise, new_rows, solve_factorised
from harness.reconstruct.solver.normal_equations import StationTargets, evaluate, normal_rows

_INITIAL_DAMPING, _DAMPING_DECREASE = 1e-4, 10.0
"""Relative to the diagonal, unlike that of `levenberg_marquardt`, which is added to it. Readings are so much stiffer
than the prior that more damping would hold the directions which the prior alone decides."""
_MAX_CHORD_STEP = 5e-3
"""After a step with no larger component [m, rad] the factorised matrix is kept for the next step."""
_MAX_EXTRAPOLATED_STEP = 2e-3
"""After a step with no larger component [m, rad] the next decrease is predicted: decreases shrink geometrically."""
_MIN_DIAGONAL = 1e-6
"""Keeps the step at 0 for a ground frame that no reading determines."""


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
    factor, step = new_rows(len(z)), np.empty(len(z))
    z[3:] = project_posture(subspace, z[3:])
    qpos = qpos_from_posture(z[3:], z[:3])
    cost = evaluate(tree, targets, state, qpos) + subspace_cost(subspace, z[3:])
    damping, longest, last_decrease = _INITIAL_DAMPING, np.inf, np.nan  # no comparison with NaN is true
    for steps in range(1, stop[2] + 1):
        normal_rows(tree, state, rows, descent)
        refactorise = longest > _MAX_CHORD_STEP
        while True:  # raise the damping until a step lowers the cost or is too short to matter
            if refactorise:
                to_subspace(tree, subspace, z, rows, factor)
                damp(subspace, factor, damping)
                if not factorise(factor):
                    return qpos, cost, -1, False
            descent_in_subspace(subspace, z, descent, step)
            solve_factorised(factor, step)
            step[3:] = project_direction(subspace, step[3:])
            longest = np.abs(step).max()
            if not np.isfinite(longest):
                return qpos, cost, -1, False
            next_z = z + step
            next_qpos = qpos_from_posture(next_z[3:], next_z[:3])
            next_cost = evaluate(tree, targets, state, next_qpos) + subspace_cost(subspace, next_z[3:])
            if next_cost <= cost or longest < stop[0]:
                break
            if refactorise:
                damping *= DAMPING_INCREASE
            refactorise = True
        decrease = cost - next_cost
        predicted = decrease * decrease / last_decrease if longest < _MAX_EXTRAPOLATED_STEP else np.inf
        converged = longest < stop[0] or decrease < stop[1] or predicted < stop[1]
        last_decrease = decrease
        if next_cost <= cost:
            z, qpos, cost, damping = next_z, next_qpos, next_cost, damping / _DAMPING_DECREASE
        if converged:
            return qpos, cost, steps, True
    return qpos, cost, stop[2], False


@compiled
def project_posture(subspace: Subspace, posture: Floats) -> Floats:
    """The posture (P,) of the subspace that is nearest to a posture (P,)."""
    return subspace.mean + project_direction(subspace, posture - subspace.mean)


@compiled
def project_direction(subspace: Subspace, direction: Floats) -> Floats:
    """The part (P,) of a direction (P,) that lies within the subspace."""
    out = direction.copy()
    for normal in subspace.normals:
        share = dot(normal, direction)
        for i in range(len(out)):
            out[i] -= share * normal[i]
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
    tilt = z[4:7]
    squared = dot(tilt, tilt)
    angle = np.sqrt(squared)
    half, sine, rest = 0.5, 1.0, 1.0 / 6.0  # limits at angle 0
    if angle > 1e-4:
        half = (1.0 - np.cos(angle)) / squared
        sine, rest = np.sin(angle) / angle, (angle - np.sin(angle)) / (squared * angle)
    out = np.empty((4, 3))
    for i in range(3):
        for j in range(3):  # the square of the tilt's cross product, and its last row
            out[1 + i, j] = rest * (tilt[i] * tilt[j] - (squared if i == j else 0.0))
        out[0, i] = half * (tilt[2] * tilt[i] - (squared if i == 2 else 0.0))
        out[1 + i, i] += 1.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[1 + j, i] += half * tilt[k]
        out[1 + i, j] -= half * tilt[k]
    out[0, 0] -= sine * tilt[1]
    out[0, 1] += sine * tilt[0]
    out[0, 2] += 1.0
    return out


@compiled
def root_motion(z: Floats) -> Floats:
    """(7, 6) Jacobian of the root's motion in the tangent: x, y, yaw, height, tilt -> translation, rotation."""
    out, rotation = np.zeros((7, 6)), _root_jacobian(z)
    out[0, 0] = out[1, 1] = out[3, 2] = 1.0
    for m in range(3):
        out[2, 3 + m] = rotation[0, m]
        for k in range(3):
            out[4 + k, 3 + m] = rotation[1 + k, m]
    return out


@compiled
def to_subspace(tree: KinematicTree, subspace: Subspace, z: Floats, rows: Floats, normal: Floats) -> None:
    """Fill in the normal equations (3 + P, 3 + P or wider), lower triangle, from those of the tangent.

    Those are the rows (V, D) of `normal_rows`. The subspace's curvature is added. Tangent: translation 0 to 2,
    root rotation 3 to 5, hinges from 6. Of z: x, y 0 and 1, yaw 2, height 3, tilt 4 to 6, hinges from 7. Hinges are the
    same in both, so only the seven leading rows and the columns of the root are transformed, by the Jacobian of the
    root's motion. The root's directions are the first six ancestors of every hinge.
    """
    jacobian, curvature = root_motion(z), subspace.curvature
    half = np.zeros((7, 6))
    for k in range(7):
        for m in range(6):
            for n in range(6):
                half[k, m] += jacobian[k, n] * (rows[m, n] if n <= m else rows[n, m])
    for k in range(7):
        for n in range(k + 1):
            total = curvature[k - 3, n - 3] if n >= 3 else 0.0
            for m in range(6):
                total += half[k, m] * jacobian[n, m]
            normal[k, n] = total
    for r in range(6, len(rows)):
        row, tangent, prior = normal[r + 1], rows[r], curvature[r - 2]
        row[0], row[1], row[3] = tangent[0], tangent[1], tangent[2] + prior[0]
        x, y, up = tangent[3], tangent[4], tangent[5]
        row[2] = jacobian[2, 3] * x + jacobian[2, 4] * y + jacobian[2, 5] * up
        for k in range(4, 7):
            row[k] = jacobian[k, 3] * x + jacobian[k, 4] * y + jacobian[k, 5] * up + prior[k - 3]
        for c in range(7, r + 2):
            row[c] = prior[c - 3]
        for d in range(6, tree.depth[r] + 1):
            row[tree.ancestors[r, d] + 1] += tangent[d]


@compiled
def trace_of_product(tree: KinematicTree, z: Floats, rows: Floats, covariance: Floats) -> float:
    """Trace of a covariance of z (3 + P, 3 + P) times normal equations of the tangent, given as rows (V, D).

    These are brought to z as in `to_subspace`, without any prior.
    """
    jacobian, total, twice = root_motion(z), 0.0, 0.0
    across = np.zeros((len(covariance), 6))  # the covariance with the tangent's root
    for i in range(len(covariance)):
        for k in range(7):
            for m in range(6):
                across[i, m] += covariance[i, k] * jacobian[k, m]
    for m in range(6):
        for n in range(m + 1):
            of_root = 0.0
            for k in range(7):
                of_root += jacobian[k, m] * across[k, n]
            if n < m:
                twice += rows[m, n] * of_root
            else:
                total += rows[m, n] * of_root
    for r in range(6, len(rows)):
        depth = tree.depth[r]
        for m in range(6):
            twice += rows[r, m] * across[r + 1, m]
        for d in range(6, depth):
            twice += rows[r, d] * covariance[r + 1, tree.ancestors[r, d] + 1]
        total += rows[r, depth] * covariance[r + 1, r + 1]
    return total + 2.0 * twice


@compiled
def descent_in_subspace(subspace: Subspace, z: Floats, descent: Floats, out: Floats) -> None:
    """Fill in the descent (3 + P,) of z, from that of the tangent (V,); the subspace's cost is added."""
    jacobian = root_motion(z)
    pull = np.dot(subspace.curvature, z[3:] - subspace.mean)
    for k in range(7):
        out[k] = dot(jacobian[k], descent[:6])
    for i in range(7, len(z)):
        out[i] = descent[i - 1]
    for i in range(len(pull)):
        out[3 + i] += subspace.linear[i] - pull[i]


@compiled
def damp(subspace: Subspace, normal: Floats, damping: float) -> None:
    """Raise the diagonal of normal equations by a share of itself; that of the subspace's spring is not damped."""
    for k in range(len(normal)):
        if k >= 3:
            normal[k, k] -= subspace.spring[k - 3] * (damping / (1.0 + damping))
        normal[k, k] = normal[k, k] * (1.0 + damping) + _MIN_DIAGONAL
