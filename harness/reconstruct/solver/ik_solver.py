"""Levenberg and Marquardt's method on the pose: residuals of trackers, a Gaussian prior, and joint limits.

Minimises  data cost + 1/2 sum_d precision_d (q_d - mean_d)^2  over configurations within the limits. Steps live in
the tangent space (root translation in world axes, root turn in its own, hinges) and solve a box-constrained
quadratic model, so that a hinge at its limit does not stall the rest. The first model is Gauss and Newton's, which
is the better one from afar; the later ones have the full curvature wherever that is positive definite. A step that
raises the cost is taken back and damped.
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import specialise
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.levenberg_marquardt import PriorAndLimits, minimise, new_quadratic_model
from harness.reconstruct.solver.residuals import Residuals


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """A Gaussian around a configuration."""

    qpos: Floats
    """(55,) its mean."""
    precision: Floats | None
    """(54,) one over the variance along each direction of the tangent [1/m^2, 1/rad^2]; 0 or None knows nothing."""


@dataclass(frozen=True)
class Stopping:
    """When a solve is finished: converged, or out of steps."""

    step: float = 1e-4
    """Converged once no component of an undamped step is larger [m, rad]: 0.1 mm, 0.006 deg."""
    decrease: float = 1e-5
    """Converged, too, once an undamped step promises to lower the cost, a log likelihood, by less."""
    most_steps: int = 30


@dataclass(frozen=True, slots=True, eq=False)
class IKSolution:
    """Where a solve ended."""

    qpos: Floats
    """(55,)"""
    cost: float
    """Data and prior, before the last step."""
    steps: int
    converged: bool


class IKSolver:
    """Solves for whatever frame its residuals have read; deterministic, each call by itself."""

    def __init__(self, residuals: Residuals, limits: HingeLimits, stopping: Stopping) -> None:
        self.residuals, self.limits, self.stopping = residuals, limits, stopping
        nv = residuals.kinematics.nv
        self._model = new_quadratic_model(residuals.tree)
        self._trust = PriorAndLimits(
            mean=np.zeros(nv + 1),
            precision=np.zeros(nv),
            low_rad=np.array(limits.low_rad),
            high_rad=np.array(limits.high_rad),
            step=stopping.step,
            decrease=stopping.decrease,
            most_steps=stopping.most_steps,
        )
        self._arrays = (residuals.tree, residuals.targets, residuals.state, self._model, self._trust)
        self._descend = specialise(minimise, *self._arrays, np.zeros(nv + 1))

    def solve(self, start: Floats, prior: Prior) -> IKSolution:
        """From a configuration (55,), clipped to the limits, downhill to a minimum."""
        trust = self._trust
        trust.mean[:] = prior.qpos
        trust.precision[:] = 0.0 if prior.precision is None else prior.precision
        qpos = np.array(start, dtype=float)
        cost, steps, converged = self._descend(*self._arrays, qpos)
        if steps < 0:
            raise ArithmeticError("normal equations are not positive definite: is a reading not finite?")
        return IKSolution(qpos, cost, steps, converged)
