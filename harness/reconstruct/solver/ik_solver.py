"""Inverse kinematics by the Levenberg-Marquardt method: residuals of trackers, a Gaussian prior, and joint limits.

It minimises  data cost + 1/2 sum_d precision_d (q_d - mean_d)^2  over configurations within the limits. Steps lie in
the tangent space (root translation in world axes, root rotation in its own, hinges). Each solves a box-constrained
quadratic model, so that a hinge at its limit does not stall the others. The first model is that of Gauss-Newton, which
is better from a distance; later ones have the full curvature wherever that is positive definite. A step that raises the
cost is undone, and the damping is raised.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled, specialise
from harness.core.ranges import Range
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.levenberg_marquardt import PriorAndLimits, minimise, new_quadratic_model
from harness.reconstruct.solver.residuals import Residuals


class Prior(NamedTuple):
    """A Gaussian prior about a configuration."""

    qpos: Floats
    """(55,) its mean."""
    precision: Floats | None
    """(54,) one over the variance along each tangent direction [1/m^2, 1/rad^2]; 0, or None for all, for no prior."""


def multiply_priors(prior: Prior, broad: Prior, weight: float) -> Prior:
    """The product of two Gaussian priors of the hinges, of which the second counts `weight` times.

    Where the first is narrow it decides; where it is wide, as far from all examples, the broad one does. The root's
    prior is that of the first. Both need precisions.
    """
    if prior.precision is None or broad.precision is None:
        raise ValueError("The product of two priors needs the precisions of both.")
    return Prior(*_multiply_hinges(prior.qpos, prior.precision, broad.qpos, broad.precision, weight))


@compiled
def _multiply_hinges(
    qpos: Floats, precision: Floats, broad_qpos: Floats, broad_precision: Floats, weight: float
) -> tuple[Floats, Floats]:
    """Mean (55,) and precision (54,) of `multiply_priors`."""
    mean, total = qpos.copy(), precision.copy()
    for i in range(6, len(total)):
        added = weight * broad_precision[i]
        total[i] += added
        mean[i + 1] += added / total[i] * (broad_qpos[i + 1] - mean[i + 1])
    return mean, total


@dataclass(frozen=True)
class Stopping:
    """Criteria of convergence, and the limit of steps."""

    step: Annotated[float, Range(0.0, 1.0)] = 1e-4
    """Converged once no component of an undamped step is larger [m, rad]: 0.1 mm, 0.006 deg."""
    decrease: Annotated[float, Range(0.0, 1.0)] = 1e-5
    """Converged, too, once an undamped step is predicted to lower the cost, a log likelihood, by less."""
    most_steps: Annotated[int, Range(1, 10_000)] = 30
    """Steps after which a solve ends without convergence."""


class IKSolution(NamedTuple):
    """The result of a solve."""

    qpos: Floats
    """(55,) the configuration."""
    cost: float
    """Cost of data and prior before the last step."""
    steps: int
    """Number of steps."""
    converged: bool
    """False when the steps were used up."""


class IKSolver:
    """Solves for the frame that its residuals have read; deterministic, and without memory between calls."""

    def __init__(self, residuals: Residuals, limits: HingeLimits, stopping: Stopping) -> None:
        self.residuals, self.limits, self.stopping = residuals, limits, stopping
        nv = residuals.kinematics.nv
        self._model = new_quadratic_model(residuals.tree)
        self._problem = PriorAndLimits(
            mean=np.zeros(nv + 1),
            precision=np.zeros(nv),
            low_rad=np.array(limits.low_rad),
            high_rad=np.array(limits.high_rad),
            step=stopping.step,
            decrease=stopping.decrease,
            most_steps=stopping.most_steps,
        )
        self._arrays = (residuals.tree, residuals.targets, residuals.state, self._model, self._problem)
        self._minimise = specialise(minimise, *self._arrays, np.zeros(nv + 1))

    def solve(self, start: Floats, prior: Prior) -> IKSolution:
        """The local minimum reached from a configuration (55,), which is clipped to the limits first.

        ArithmeticError when a reading is not finite.
        """
        self._problem.mean[:] = prior.qpos
        self._problem.precision[:] = 0.0 if prior.precision is None else prior.precision
        qpos = np.array(start, dtype=float)
        cost, steps, converged = self._minimise(*self._arrays, qpos)
        if steps < 0:
            raise ArithmeticError("The normal equations are not positive definite: is a reading not finite?")
        return IKSolution(qpos, cost, steps, converged)
