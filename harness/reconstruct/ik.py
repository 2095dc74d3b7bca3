"""Inverse kinematics: the whole body fitted to the trackers, frame by frame (docs/methods.md C1).

The prior only settles what the trackers leave open: a wide Gaussian, 30 deg per hinge, about the previous pose or
about the mean of examples. The root has none.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.core.motion import Take
from harness.reconstruct.coverage import LOST_AFTER_S, Coverage
from harness.reconstruct.gate import JUMP_M, PATIENCE_S, Gate
from harness.reconstruct.hinges import HingeLimits
from harness.reconstruct.mean_pose import mean_posture
from harness.reconstruct.placing import placed, postures
from harness.reconstruct.residuals import Loss, Residuals
from harness.reconstruct.solver import Prior, Solution, Solver, Stopping
from harness.stream.frame import TrackerFrame

_FAR = 2.0
"""A reading contradicts the pose when it is off by more than so many times the Lorentzian's scale: 6 cm, 16 deg."""
_MANY = 0.25
"""When this share of the readings does so, the pose is sought anew at once; else once it has lasted `PATIENCE_S`."""
_WIDENINGS = (10.0, 3.0, 1.0)
"""How much farther the Lorentzian reaches while a cold start closes in."""


@dataclass(frozen=True)
class Ik:
    """Options of inverse kinematics; a `Method`."""

    name: str = "ik"
    summary: str = (
        "whole-body Levenberg-Marquardt on the trackers, robust, held to the previous pose where they leave it open"
    )
    loss: Loss = field(default_factory=Loss)
    prior: Literal["previous", "mean", "none"] = "previous"
    """What fills in where trackers are silent; `mean` learns the examples' mean posture."""
    prior_sigma_rad: float = math.radians(30.0)
    """Of every hinge [rad]."""
    limits: bool = True
    """Keep hinges within the body's limits."""
    jump_m: float = JUMP_M
    """A position that jumps farther than this from where the body carries it is left out for a while; inf never [m]."""
    lost_after_s: float = LOST_AFTER_S
    stopping: Stopping = field(default_factory=Stopping)

    @property
    def needs_examples(self) -> bool:
        return self.prior == "mean"

    def fit(self, body: Body, examples: Sequence[Take], rng: np.random.Generator) -> "FittedIk":
        """BadInput when the prior needs examples and there are none."""
        return FittedIk(self, body, mean_posture(body, examples) if self.prior == "mean" else None)


GAUSSIAN = Ik(
    "ik:gaussian",
    "the same with squared residuals and no gate: what robustness is worth",
    loss=Loss(robust=False),
    jump_m=math.inf,
)
MEAN = Ik("ik:mean", "the same pulled weakly to the examples' mean posture instead of the previous pose", prior="mean")


@dataclass(frozen=True, eq=False)
class FittedIk:
    """Options and body."""

    options: Ik
    body: Body
    mean_qpos: Floats | None = None
    """(55,) T-pose root, mean hinges."""

    def begin(self, calibration: Calibration) -> "IkSession":
        return IkSession(self, calibration)


class IkSession:
    """Follows one performer; starts, and starts again, from the T-pose and its kin."""

    def __init__(self, fitted: FittedIk, calibration: Calibration) -> None:
        options, body = fitted.options, fitted.body
        self._options = options
        self._residuals = Residuals(body, calibration, options.loss)
        self._limits = HingeLimits(body, keep=options.limits)
        self._solver = Solver(self._residuals, self._limits, options.stopping)
        self._coverage = Coverage(options.lost_after_s)
        self._gate = Gate(len(calibration.stations), options.jump_m)
        self._mean_qpos = fitted.mean_qpos
        self._precision = np.zeros(self._residuals.kinematics.nv)
        if options.prior != "none":
            self._precision[6:] = options.prior_sigma_rad**-2
        self._starts = [*postures(body), *([] if fitted.mean_qpos is None else [fitted.mean_qpos])]
        self._qpos = self._starts[0]
        self._started, self._following = False, False
        self._contradicted_since_s: float | None = None

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.seen(frame)
        if any_seen:
            self._gate.read(frame, self._residuals)
            start_anew = self._gate.all_moved or (
                not self._following and (status is Status.SOLVED or not self._started)
            )
            self._qpos = self._tidy(self._cold().qpos if start_anew else self._followed(frame.received_s))
            self._started = True
            self._gate.answered(frame, self._residuals, self._qpos)
        self._following = status is Status.SOLVED or (self._following and status is not Status.LOST)
        return Estimate(self._qpos, status)

    def _followed(self, now_s: float) -> Floats:
        """From the previous pose; anew when the readings contradict where that leads."""
        warm = self._solve(self._qpos, self._qpos)
        contradicted = self._contradiction()
        if contradicted == 0.0 and not self._gate.left_out:
            self._contradicted_since_s = None
            return warm.qpos
        if self._contradicted_since_s is None:
            self._contradicted_since_s = now_s
        if contradicted < _MANY and (self._gate.left_out or now_s - self._contradicted_since_s < PATIENCE_S):
            return warm.qpos
        self._contradicted_since_s = now_s
        cold = self._cold()
        return cold.qpos if cold.cost < 0.8 * warm.cost else warm.qpos

    def _cold(self) -> Solution:
        """The cheapest pose found from the last one and from the starting postures, stood where the readings are."""
        found = []
        for posture in (self._qpos, *self._starts):
            for start in placed(self._residuals, posture):
                qpos = start
                for factor in _WIDENINGS:
                    self._residuals.widen(factor)
                    solution = self._solve(qpos, start)
                    qpos = solution.qpos
                found.append(solution)
        return min(found, key=lambda solution: solution.cost)

    def _solve(self, start: Floats, previous: Floats) -> Solution:
        mean = previous
        if self._mean_qpos is not None:
            mean = np.concatenate([start[:7], self._limits.near(self._mean_qpos[7:], start[7:])])
        return self._solver.solve(start, Prior(mean, self._precision))

    def _contradiction(self) -> float:
        """The share of readings that lie far from the pose."""
        far = (self._residuals.distance > _FAR * self._residuals.scale) & self._residuals.measured
        return float(np.count_nonzero(far)) / float(np.count_nonzero(self._residuals.measured))

    def _tidy(self, qpos: Floats) -> Floats:
        """The same pose in lawful angles: past a gimbal's pole the limits hold for the twin."""
        if self._limits.past_gimbal(qpos[7:]):
            qpos = np.concatenate([qpos[:7], self._limits.principal(qpos[7:])])
        return qpos
