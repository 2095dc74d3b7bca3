"""Inverse kinematics: the whole body fitted to the trackers, frame by frame (docs/methods.md C1).

The prior only settles what the trackers leave open: a wide Gaussian of the hinges about the previous pose, about the
mean posture of examples, or about a pose in between; as wide for every hinge, or in proportion to how far the examples
move it. The root has none. `scenarios/tune_ik.toml` is the search that chose `ik`; the others show what it is worth.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.methods.mean_pose import mean_posture, spread_rad
from harness.reconstruct.solver.ik_session import IKSession, PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import Stopping
from harness.reconstruct.solver.outlier_gate import JUMP_M
from harness.reconstruct.solver.residuals import Loss
from harness.reconstruct.solver.status_monitor import LOST_AFTER_S

_MIN_SPREAD_RAD = math.radians(2.0)


@dataclass(frozen=True)
class Ik:
    """Options of inverse kinematics; a `Method`."""

    name: str = "ik"
    summary: str = "whole-body Levenberg-Marquardt on the trackers, robust, pulled weakly to the examples' mean posture"
    loss: Loss = field(default_factory=Loss)
    towards_mean: float = 0.1
    """Where the prior's mean lies between the previous pose, 0, and the examples' mean posture, 1."""
    prior_sigma_rad: float = math.radians(30.0)
    """Root mean square of the hinges' standard deviations [rad]; inf for no prior."""
    spread: bool = True
    """Whether each hinge's own follows its spread over the examples; else all have the same."""
    limits: bool = True
    """Keep hinges within the body's limits."""
    jump_m: float = JUMP_M
    """A position that jumps farther than this from where the body carries it is left out for a while; inf never [m]."""
    lost_after_s: float = LOST_AFTER_S
    stopping: Stopping = field(default_factory=Stopping)

    @property
    def needs_examples(self) -> bool:
        return self.towards_mean > 0.0 or self.spread

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedIk":
        """BadInput when the prior needs examples and there are none."""
        return self._fitted(body, examples)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedIk":
        """From a database that may lie on disk."""
        return self._fitted(body, database)

    def _fitted(self, body: Body, examples: Sequence[BodyMotion] | MotionDatabase) -> "FittedIk":
        sigma_rad = np.full(48, self.prior_sigma_rad)
        if not self.needs_examples:
            return FittedIk(self, body, None, sigma_rad)
        mean_qpos = mean_posture(body, examples)
        if self.spread:
            own = np.maximum(spread_rad(body, examples, mean_qpos), _MIN_SPREAD_RAD)
            sigma_rad *= own / np.sqrt(np.mean(own**2))
        return FittedIk(self, body, mean_qpos, sigma_rad)


PREVIOUS = Ik(
    "ik:previous",
    "the same held to the previous pose alone, all hinges alike: learns nothing",
    towards_mean=0.0,
    spread=False,
)
MEAN = Ik(
    "ik:mean", "the same held to the examples' mean posture alone, all hinges alike", towards_mean=1.0, spread=False
)
GAUSSIAN = Ik(
    "ik:gaussian",
    "the same with squared residuals and no gate: what robustness is worth",
    loss=Loss(robust=False),
    jump_m=math.inf,
)


@dataclass(frozen=True, eq=False)
class FittedIk:
    """Options, body and prior."""

    options: Ik
    body: Body
    mean_qpos: Floats | None
    """(55,) T-pose root, mean hinges; None when there is nothing to learn it from."""
    sigma_rad: Floats
    """(48,) the prior's standard deviations."""

    def begin(self, calibration: Calibration) -> IKSession:
        options = self.options
        manner = SolverOptions(options.loss, options.limits, options.jump_m, options.lost_after_s, options.stopping)
        return IKSession(
            self.body, calibration, manner, PosturePrior(self.mean_qpos, self.sigma_rad, options.towards_mean)
        )
