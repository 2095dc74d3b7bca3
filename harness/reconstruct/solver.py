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
    precision: Floats
    """(54,) one over the variance along each direction of the tangent [1/m^2, 1/rad^2]; 0 knows nothing."""


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


_DAMPING, _FIRST_RAISE, _RAISE = 1e-2, 1.0, 30.0
_LONGEST_TURN_RAD = 1.0


class Solver:
    """Solves for whatever frame its residuals have read; deterministic, each call by itself."""

    def __init__(self, residuals: Residuals, limits: HingeLimits, stopping: Stopping) -> None:
        nv = residuals.kinematics.nv
        self.residuals, self.limits, self.stopping = residuals, limits, stopping
        self._program = BoxQP(nv)
        self._diagonal = slice(None, None, nv + 1)
        self._least, self._most = np.full(nv, -np.inf), np.full(nv, np.inf)

    def solve(self, start: Floats, prior: Prior) -> Solution:
        """From a configuration (55,), clipped to the limits, downhill to a minimum."""
        stopping, residuals = self.stopping, self.residuals
        qpos = np.array(start, dtype=float)
        qpos[7:] = self.limits.clipped(qpos[7:])
        cost, away = self._cost(qpos, prior)
        damping, fresh = _DAMPING, False
        curved: Floats | None = None
        for steps in range(1, stopping.most_steps + 1):
            if not fresh:
                hessian, descent = residuals.normal_equations()
                hessian.reshape(-1)[self._diagonal] += prior.precision
                descent += prior.precision * away
                curved = hessian + residuals.curvature() if steps > 1 else None
                fresh = True
            step = None if curved is None else self._step(qpos, curved, descent, damping)
            if step is None:
                step = self._step(qpos, hessian, descent, damping)
            if step is None:
                raise ArithmeticError("normal equations are not positive definite: is a reading not finite?")
            promised, longest = 0.5 * float(descent @ step), float(np.max(np.abs(step)))
            if longest > _LONGEST_TURN_RAD:
                step[3:] *= min(1.0, _LONGEST_TURN_RAD / float(np.max(np.abs(step[3:]))))
            moved = residuals.kinematics.moved(qpos, step)
            if damping == _DAMPING and (longest < stopping.step or promised < stopping.decrease):
                return Solution(moved, cost, steps, True)
            new_cost, new_away = self._cost(moved, prior)
            if new_cost < cost:
                qpos, cost, away = moved, new_cost, new_away
                damping, fresh = max(_DAMPING, damping / _RAISE**2), False
            else:
                curved, damping = None, max(_FIRST_RAISE, damping * _RAISE)
        return Solution(qpos, cost, stopping.most_steps, False)

    def _cost(self, qpos: Floats, prior: Prior) -> tuple[float, Floats]:
        """Data and prior; and the tangent step (54,) from here to the prior's mean."""
        away = self.residuals.kinematics.difference(qpos, prior.qpos)
        return self.residuals.place(qpos) + 0.5 * float(prior.precision @ (away * away)), away

    def _step(self, qpos: Floats, hessian: Floats, descent: Floats, damping: float) -> Floats | None:
        """(54,) the minimum of the damped model within the limits; None where it has none."""
        damped = hessian.copy()
        damped.reshape(-1)[self._diagonal] += damping
        np.subtract(self.limits.low_rad, qpos[7:], out=self._least[6:])
        np.subtract(self.limits.high_rad, qpos[7:], out=self._most[6:])
        return self._program.solve(damped, descent, self._least, self._most)
