"""Any method with its answer pulled onto the trackers: the final inverse kinematics of Kim et al. 2012 (B5).

Levenberg-Marquardt from the method's pose, which is also the prior's mean; `+ik` after the method's name.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.body.humanoid import Body
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.reconstruct.contract import Method, Reconstructor, Session
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
from harness.reconstruct.solver.outlier_gate import OutlierGate
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream.frame import TrackerFrame

SUFFIX = "+ik"


@dataclass(frozen=True)
class CleanUp:
    """A `Method` around another."""

    method: Method
    loss: Loss = field(default_factory=Loss)
    stopping: Stopping = field(default_factory=Stopping)
    prior_sigma_rad: float = math.radians(30.0)
    """How freely each hinge may leave the method's pose [rad]; the root may at will."""

    @property
    def name(self) -> str:
        return self.method.name + SUFFIX

    @property
    def summary(self) -> str:
        return f"{self.method.summary}; then fitted to the trackers"

    @property
    def needs_examples(self) -> bool:
        return self.method.needs_examples

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedCleanUp":
        return FittedCleanUp(self, body, self.method.fit(body, examples, rng))


@dataclass(frozen=True, eq=False)
class FittedCleanUp:
    """The other method, fitted."""

    options: CleanUp
    body: Body
    inner: Reconstructor

    def begin(self, calibration: Calibration) -> "CleanUpSession":
        return CleanUpSession(self, calibration, self.inner.begin(calibration))


class CleanUpSession:
    """Corrects what the inner session answers and never talks back to it."""

    def __init__(self, fitted: FittedCleanUp, calibration: Calibration, inner: Session) -> None:
        self._inner = inner
        self._residuals = Residuals(fitted.body, calibration, fitted.options.loss)
        self._gate = OutlierGate(len(calibration.stations))
        self._limits = HingeLimits(fitted.body)
        self._solver = IKSolver(self._residuals, self._limits, fitted.options.stopping)
        self._precision = np.zeros(self._residuals.kinematics.nv)
        self._precision[6:] = fitted.options.prior_sigma_rad**-2

    def step(self, frame: TrackerFrame) -> Estimate:
        guess = self._inner.step(frame)
        if not (frame.position_valid.any() or frame.orientation_valid.any()):
            return guess
        self._gate.read(frame, self._residuals)
        start = np.concatenate([guess.qpos[:7], self._limits.clip(self._limits.principal(guess.qpos[7:]))])
        qpos = self._solver.solve(start, Prior(start, self._precision)).qpos
        self._gate.update(self._residuals, qpos)
        return Estimate(qpos, guess.status)
