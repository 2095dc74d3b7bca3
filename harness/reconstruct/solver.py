"""Levenberg and Marquardt's method on the pose: residuals of trackers, a Gaussian prior, and joint limits.

Minimises  data cost + 1/2 sum_d precision_d (q_d - mean_d)^2  over configurations within the limits. Steps live in
the tangent space (root translation in world axes, root turn in its own, hinges) and solve a box-constrained
quadratic model, so that a hinge at its limit does not stall the rest. The first model is Gauss and Newton's, which
is the better one from afar; the later ones have the full curvature wherever that is positive definite. A step that
raises the cost is taken back and damped.
"""

from dataclasses import dataclass

import numpy as np

from harness.body.box import BoxQP
from harness.core.arrays import Floats
from harness.reconstruct.hinges import HingeLimits
from harness.reconstruct.residuals import Residuals


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
class Solution:
    """Where a solve ended."""

    qpos: Floats
    """(55,)"""
    cost: float
    """Data and prior, before the last step."""
    steps: int
    converged: bool


_DAMPING, _RAISE, _LOWER = 0.3, 10.0, 3.0
_MODEST = 30.0
"""Damping that still lets a step go where it wants: as a prior, 10 deg about the present pose [1/rad^2]."""
_GOOD, _FAIR = 0.9, 0.5
"""Shares of a step's promise kept: the plain model will do from the one, damping may fall from the other."""
_LONGEST_TURN_RAD = 1.0
_SMALL = 1e-2
"""A step that promises next to nothing is still taken when it is no larger [m, rad]."""


class Solver:
    """Solves for whatever frame its residuals have read; deterministic, each call by itself."""

    def __init__(self, residuals: Residuals, limits: HingeLimits, stopping: Stopping) -> None:
        nv = residuals.kinematics.nv
        self.residuals, self.limits, self.stopping = residuals, limits, stopping
        self._program = BoxQP(nv)
        self._hessian, self._bent = np.zeros((nv, nv)), np.zeros((nv, nv))
        self._diagonal = self._hessian.reshape(-1)[:: nv + 1]
        self._least, self._most = np.full(nv, -np.inf), np.full(nv, np.inf)
        self._least_hinge, self._most_hinge = self._least[6:], self._most[6:]
        self._away = np.zeros(nv)

    def solve(self, start: Floats, prior: Prior) -> Solution:
        """From a configuration (55,), clipped to the limits, downhill to a minimum."""
        stopping, residuals, kinematics = self.stopping, self.residuals, self.residuals.kinematics
        qpos = np.array(start, dtype=float)
        qpos[7:] = self.limits.clipped(qpos[7:])
        cost = residuals.place(qpos) + self._prior_cost(qpos, prior)
        damping, kept, fresh = _DAMPING, 1.0, False
        for steps in range(1, stopping.most_steps + 1):
            if not fresh:
                gradient = self._linearise(prior, damping)
                fresh = True
            step = self._step(qpos, gradient, curved=kept < _GOOD)
            promised, longest = -0.5 * float(gradient @ step), float(abs(step).max())
            if longest > _LONGEST_TURN_RAD:
                step[3:] *= min(1.0, _LONGEST_TURN_RAD / float(abs(step[3:]).max()))
            moved = kinematics.moved(qpos, step)
            if damping <= _MODEST and (longest < stopping.step or promised < stopping.decrease):
                return Solution(moved if longest < _SMALL else qpos, cost, steps, True)
            new_cost = residuals.place(moved) + self._prior_cost(moved, prior)
            kept = (cost - new_cost) / promised
            if new_cost < cost:
                qpos, cost, fresh = moved, new_cost, False
                damping = max(_DAMPING, damping / _LOWER) if kept > _FAIR else damping
                if cost < stopping.decrease:
                    return Solution(qpos, cost, steps, True)
            else:
                more = max(_RAISE, damping * _RAISE)
                self._diagonal += more - damping
                damping = more
        return Solution(qpos, cost, stopping.most_steps, False)

    def _prior_cost(self, qpos: Floats, prior: Prior) -> float:
        if prior.precision is None:
            return 0.0
        self._away = self.residuals.kinematics.difference(qpos, prior.qpos)
        return 0.5 * float(prior.precision @ (self._away * self._away))

    def _linearise(self, prior: Prior, damping: float) -> Floats:
        gradient = -self.residuals.normal_equations(self._hessian)
        if prior.precision is not None:
            gradient -= prior.precision * self._away
            self._diagonal += prior.precision
        self._diagonal += damping
        return gradient

    def _step(self, qpos: Floats, gradient: Floats, curved: bool) -> Floats:
        """(54,) the minimum of the damped model within the limits."""
        np.subtract(self.limits.low_rad, qpos[7:], out=self._least_hinge)
        np.subtract(self.limits.high_rad, qpos[7:], out=self._most_hinge)
        step: Floats | None = None
        if curved:
            np.copyto(self._bent, self._hessian)
            self.residuals.add_curvature(self._bent)
            step = self._program.solve(self._bent, gradient, self._least, self._most)
        if step is None:
            step = self._program.solve(self._hessian, gradient, self._least, self._most)
        if step is None:
            raise ArithmeticError("normal equations are not positive definite: is a reading not finite?")
        return step
