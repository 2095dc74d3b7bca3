"""The Levenberg-Marquardt method on a pose, with a Gaussian prior and joint limits, compiled; see `ik_solver`.

Matrices are rows (V, D), as in `normal_equations`. They are factorised from the last direction to the first, so that
every entry of the factor falls on an ancestor and no space is needed elsewhere.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import as_tuple, quaternion_from_vector, quaternion_product, rotation_vector
from harness.reconstruct.solver.kinematic_tree import KinematicState, KinematicTree
from harness.reconstruct.solver.matrix_algebra import dot
from harness.reconstruct.solver.normal_equations import StationTargets, add_curvature, evaluate, normal_rows

_INITIAL_DAMPING, DAMPING_INCREASE, DAMPING_DECREASE = 0.3, 10.0, 3.0
_MAX_CONVERGED_DAMPING = 30.0
"""Convergence is tested below this damping only: as a prior it is 10 deg about the present pose [1/rad^2]."""
_GOOD_GAIN_RATIO, _FAIR_GAIN_RATIO = 0.9, 0.5
"""Ratios of actual to predicted decrease: above the first Gauss-Newton suffices, above the second the damping falls."""
_MAX_STEP_RAD = 1.0
"""Larger rotations are scaled down to this."""
_MAX_FINAL_STEP = 1e-2
"""A converged step is still taken when no component is larger [m, rad]."""
_MIN_DECREASE = 1e-12
"""A predicted decrease of the cost, a log likelihood, that is only rounding."""


class QuadraticModel(NamedTuple):
    """A quadratic model g x + 1/2 x H x of one step x (V,), low <= x <= high, and arrays to minimise it."""

    hessian: Floats
    """(V, D) Gauss-Newton matrix with prior and damping."""
    full_hessian: Floats
    """(V, D) the same with the full curvature."""
    factor: Floats
    """(V, D) L^T D L of the free directions."""
    gradient: Floats
    """(V,) gradient at the step 0."""
    step: Floats
    """(V,) the minimum."""
    to_mean: Floats
    """(V,) tangent step from the configuration to the prior's mean."""
    residual_gradient: Floats
    """(V,) gradient of the model at the present step."""
    direction: Floats
    """(V,) Newton direction from the present step."""
    trial: Floats
    """(V,) the step that is tried next."""
    change: Floats
    """(V,) the trial minus the present step."""
    hessian_change: Floats
    """(V,) H times the change."""
    low: Floats
    """(V,) lower bounds of the step."""
    high: Floats
    """(V,) upper bounds of the step."""
    next_qpos: Floats
    """(V + 1,) the configuration after the step."""
    clamped: Bools
    """(V,) whether a direction is held at a bound."""


class PriorAndLimits(NamedTuple):
    """A Gaussian prior, the hinges' limits, and when to stop."""

    mean: Floats
    """(V + 1,) configuration."""
    precision: Floats
    """(V,) one over the variance along each direction [1/m^2, 1/rad^2]."""
    low_rad: Floats
    """(V - 6,) lower limits of the hinges."""
    high_rad: Floats
    """(V - 6,) upper limits of the hinges."""
    step: float
    """`Stopping.step`."""
    decrease: float
    """`Stopping.decrease`."""
    most_steps: int
    """`Stopping.most_steps`."""


def new_quadratic_model(tree: KinematicTree) -> QuadraticModel:
    """Arrays for one solver; the root is unbounded."""
    directions = len(tree.depth)
    bounds = np.full(directions, -np.inf), np.full(directions, np.inf)
    matrices, vectors = np.zeros((3, *tree.ancestors.shape)), np.zeros((8, directions))
    return QuadraticModel._make([*matrices, *vectors, *bounds, np.zeros(directions + 1), np.zeros(directions, bool)])


@compiled
def minimise(
    tree: KinematicTree,
    targets: StationTargets,
    state: KinematicState,
    model: QuadraticModel,
    problem: PriorAndLimits,
    qpos: Floats,
) -> tuple[float, int, bool]:
    """Move a configuration (V + 1,) downhill, in place.

    Returns the cost before the last step, the number of steps, and whether it converged; -1 steps when the normal
    equations are not positive definite, which happens only if a reading is not finite.
    """
    for i in range(7, len(qpos)):
        qpos[i] = min(max(qpos[i], problem.low_rad[i - 7]), problem.high_rad[i - 7])
    hessian, gradient, step, next_qpos = model.hessian, model.gradient, model.step, model.next_qpos
    cost = evaluate(tree, targets, state, qpos) + _prior_cost(problem, qpos, model.to_mean)
    damping, gain_ratio, linearised = _INITIAL_DAMPING, 1.0, False
    for steps in range(1, problem.most_steps + 1):
        # 1. The model about the present configuration, unless the last step was rejected.
        if not linearised:
            normal_rows(tree, state, hessian, gradient)
            for i in range(len(step)):
                gradient[i] = -gradient[i] - problem.precision[i] * model.to_mean[i]
                hessian[i, tree.depth[i]] += problem.precision[i] + damping
            for i in range(6, len(step)):
                model.low[i] = min(problem.low_rad[i - 6] - qpos[i + 1], 0.0)
                model.high[i] = max(problem.high_rad[i - 6] - qpos[i + 1], 0.0)
            linearised = True
        # 2. Its minimum: with full curvature once Gauss-Newton predicts badly, and if that is positive definite.
        solved = False
        if gain_ratio < _GOOD_GAIN_RATIO:
            model.full_hessian[:] = hessian
            add_curvature(tree, state, model.full_hessian)
            solved = solve_box_qp(tree, model, model.full_hessian)
        if not solved and not solve_box_qp(tree, model, hessian):
            return cost, -1, False
        predicted, longest = -0.5 * dot(gradient, step), np.abs(step).max()
        if longest > _MAX_STEP_RAD:
            step[3:] *= min(1.0, _MAX_STEP_RAD / np.abs(step[3:]).max())
        _integrate(qpos, step, next_qpos)
        if damping <= _MAX_CONVERGED_DAMPING and (longest < problem.step or predicted < problem.decrease):
            if longest < _MAX_FINAL_STEP:
                qpos[:] = next_qpos
            return cost, steps, True
        # 3. The step is accepted if it lowers the cost; otherwise the state is restored and the damping raised.
        next_cost = evaluate(tree, targets, state, next_qpos) + _prior_cost(problem, next_qpos, model.to_mean)
        gain_ratio = (cost - next_cost) / predicted
        if next_cost < cost:
            qpos[:] = next_qpos
            cost, linearised = next_cost, False
            damping = max(_INITIAL_DAMPING, damping / DAMPING_DECREASE) if gain_ratio > _FAIR_GAIN_RATIO else damping
            if cost < problem.decrease:
                return cost, steps, True
        else:
            evaluate(tree, targets, state, qpos)
            higher = max(DAMPING_INCREASE, damping * DAMPING_INCREASE)
            for i in range(len(step)):
                hessian[i, tree.depth[i]] += higher - damping
            damping = higher
    return cost, problem.most_steps, False


@compiled
def _prior_cost(problem: PriorAndLimits, qpos: Floats, to_mean: Floats) -> float:
    """The prior's cost of a configuration; fills in the tangent step (V,) from there to the prior's mean."""
    mean, q, cost = problem.mean, qpos[3:7], 0.0
    to_mean[:3] = mean[:3] - qpos[:3]
    turn = quaternion_product((q[0], -q[1], -q[2], -q[3]), as_tuple(mean[3:7]))
    to_mean[3], to_mean[4], to_mean[5] = rotation_vector(turn)
    to_mean[6:] = mean[7:] - qpos[7:]
    for i in range(len(to_mean)):
        cost += 0.5 * problem.precision[i] * to_mean[i] ** 2
    return cost


@compiled
def _integrate(qpos: Floats, step: Floats, next_qpos: Floats) -> None:
    """Fill in the configuration after a tangent step (V,); the root rotates about its own axes."""
    next_qpos[:3] = qpos[:3] + step[:3]
    rotation = quaternion_product(as_tuple(qpos[3:7]), quaternion_from_vector(step[3], step[4], step[5]))
    next_qpos[3], next_qpos[4], next_qpos[5], next_qpos[6] = rotation
    next_qpos[3:7] /= np.sqrt(dot(next_qpos[3:7], next_qpos[3:7]))
    next_qpos[7:] = qpos[7:] + step[6:]


@compiled
def solve_box_qp(tree: KinematicTree, model: QuadraticModel, hessian: Floats) -> bool:
    """Fill in `model.step` by projected Newton steps (Tassa et al. 2014, box-DDP); 0 must lie within the bounds.

    Returns False unless H is positive definite on the directions that the bounds leave free.
    """
    x, gradient, direction, trial, change, hessian_change = (
        *(model.step, model.residual_gradient, model.direction),
        *(model.trial, model.change, model.hessian_change),
    )
    x[:] = 0.0
    gradient[:] = model.gradient
    full_step = False
    for attempt in range(100):
        # Clamp a direction that is at a bound and that the gradient presses against it.
        changed = attempt == 0
        for i in range(len(x)):
            clamped = (x[i] <= model.low[i] and gradient[i] > 0.0) or (x[i] >= model.high[i] and gradient[i] < 0.0)
            changed = changed or clamped != model.clamped[i]
            model.clamped[i] = clamped
            direction[i] = 0.0 if clamped else -gradient[i]
        if full_step and not changed:  # a full Newton step on the same set: its minimum
            return True
        if changed and not _factorise(tree, hessian, model.clamped, model.factor):
            return False
        _solve_factorised(tree, model.factor, direction)
        if not dot(gradient, direction) < -_MIN_DECREASE:
            return True
        # Backtrack along the projected direction until the decrease is sufficient (Armijo's rule with 0.1).
        share, clamped_count = 1.0, 0
        while True:
            full_step, clamped_count, predicted = share == 1.0, 0, 0.0
            for i in range(len(x)):
                free = x[i] + share * direction[i]
                trial[i] = min(max(free, model.low[i]), model.high[i])
                full_step = full_step and trial[i] == free
                clamped_count += model.clamped[i]
                change[i] = trial[i] - x[i]
                predicted += gradient[i] * change[i]
            if full_step and clamped_count == 0:
                x[:] = trial
                return True
            _multiply_symmetric(tree, hessian, change, hessian_change)
            if full_step or predicted + 0.5 * dot(change, hessian_change) <= 0.1 * predicted or share < 1e-9:
                break
            share *= 0.5
        for i in range(len(x)):
            x[i] = trial[i]
            gradient[i] += hessian_change[i]
    return True


@compiled
def _factorise(tree: KinematicTree, hessian: Floats, clamped: Bools, factor: Floats) -> bool:
    """Fill in L^T D L of the free directions, D last in each row; False unless positive definite.

    Featherstone 2008, sec. 6.5. Row k is done once all directions beyond k are. Eliminating k changes only the rows of
    its ancestors: its entry with the ancestor at depth d, times its entries with those at depths e <= d.
    A clamped direction becomes a row of the identity.
    """
    for k in range(len(factor)):
        for d in range(tree.depth[k] + 1):
            factor[k, d] = 0.0 if clamped[k] or clamped[tree.ancestors[k, d]] else hessian[k, d]
        if clamped[k]:
            factor[k, tree.depth[k]] = 1.0
    for k in range(len(factor) - 1, -1, -1):
        row, depth = factor[k], tree.depth[k]
        if not row[depth] > 0.0:  # NaN fails, too
            return False
        for d in range(depth - 1, -1, -1):
            share = row[d] / row[depth]
            if share != 0.0:
                ancestor = factor[tree.ancestors[k, d]]
                for e in range(d + 1):
                    ancestor[e] -= share * row[e]  # entries e <= d of this row are not divided yet
                row[d] = share
    return True


@compiled
def _solve_factorised(tree: KinematicTree, factor: Floats, x: Floats) -> None:
    """x := (L^T D L)^-1 x, in place: from the limbs inwards with L^T, then outwards with D and L."""
    for k in range(len(x) - 1, -1, -1):
        for d in range(tree.depth[k]):
            x[tree.ancestors[k, d]] -= factor[k, d] * x[k]
    for k in range(len(x)):
        x[k] /= factor[k, tree.depth[k]]
        for d in range(tree.depth[k]):
            x[k] -= factor[k, d] * x[tree.ancestors[k, d]]


@compiled
def _multiply_symmetric(tree: KinematicTree, hessian: Floats, x: Floats, out: Floats) -> None:
    """Fill in H x (V,); every stored entry counts on both sides of the diagonal."""
    for k in range(len(x)):
        out[k] = hessian[k, tree.depth[k]] * x[k]
        for d in range(tree.depth[k]):
            i = tree.ancestors[k, d]
            out[k] += hessian[k, d] * x[i]
            out[i] += hessian[k, d] * x[k]
