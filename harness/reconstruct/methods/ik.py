"""Inverse kinematics (`ik`): the whole body is fitted to the trackers, frame by frame (docs/papers.md C1).

Each frame is a robust least-squares problem in the 54 degrees of freedom, solved by Levenberg-Marquardt from the last
estimate, within the hinges' limits. A weak Gaussian prior of the hinges settles what the trackers leave open. The root
has no prior. A position that jumps is left out by the outlier gate.

Source: the field's standard method; papers use it as a baseline and as the last step of other methods.

Options, with units and defaults, are the fields of `Ik` and of `SolverOptions`. Three groups matter:

- The prior: its mean lies between the last estimate (`towards_mean` 0) and the examples' mean posture (1); default 0.1.
  Its standard deviation is 30 deg (RMS over hinges), in proportion to each hinge's spread over the examples (`spread`).
- Robustness: `loss` (scales of the robust residuals) and `jump_m` (outlier gate).
- `limits` and `stopping` (convergence).

Presets: `ik:previous` (prior about the last estimate, learns nothing), `ik:mean` (prior about the mean posture),
`ik:gaussian` (squared residuals, no gate). `scenarios/tune_ik.toml` is the search that chose the defaults.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar

import numpy as np

from harness.body import Body
from harness.core.estimate import LOST_AFTER_ADVICE
from harness.core.motion import BodyMotion
from harness.core.ranges import Range
from harness.core.split import EXAMPLES, NONE
from harness.reconstruct.contract import Fitted
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.posture_statistics import mean_posture, scaled_spread_rad
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.solver.ik_session import IKSession, PosturePrior, SolverOptions
from harness.reconstruct.solver.residuals import Loss

_MIN_SPREAD_RAD = math.radians(2.0)
"""Smallest spread of a hinge over the examples that scales the prior."""


@dataclass(frozen=True)
class Ik(SolverOptions):
    """Options of inverse kinematics, a `Method`."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"lost_after_s": LOST_AFTER_ADVICE}

    name: str = "ik"
    summary: str = "robust whole-body inverse kinematics with a weak prior about the examples' mean posture"
    towards_mean: Annotated[float, Range(0.0, 1.0)] = 0.1
    """Mean of the prior: 0 is the last estimate, 1 the examples' mean posture."""
    prior_sigma_rad: Annotated[float, Range(1e-06, 100.0)] = math.radians(30.0)
    """Root mean square of the hinges' standard deviations [rad]; inf for no prior."""
    spread: bool = True
    """Whether each hinge's standard deviation is proportional to its spread over the examples; else all are equal."""
    limits: bool = True
    """Keep hinges within the body's limits."""

    @property
    def needs_examples(self) -> bool:
        return self.towards_mean > 0.0 or self.spread

    @property
    def training_data(self) -> str:
        return EXAMPLES if self.needs_examples else NONE

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> Fitted[IKSession]:
        """Learn the prior from examples; BadInput when it needs some and there are none."""
        return self._fitted(body, examples)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> Fitted[IKSession]:
        """Learn the prior from a database, which may lie on disk."""
        return self._fitted(body, database)

    def _fitted(self, body: Body, examples: Sequence[BodyMotion] | MotionDatabase) -> Fitted[IKSession]:
        increments = StationIncrements(body, examples if self.needs_examples else ())
        prior = self.posture_prior(body, examples)
        return Fitted(partial(IKSession, body, options=self, posture_prior=prior, moments=increments.moments))

    def posture_prior(self, body: Body, examples: Sequence[BodyMotion] | MotionDatabase) -> PosturePrior:
        """The prior of the hinges; BadInput when it needs examples and there are none."""
        equal_rad = np.full(48, self.prior_sigma_rad)
        if not self.needs_examples:
            return PosturePrior(None, equal_rad, self.towards_mean)
        sigma_rad = equal_rad
        mean_qpos = mean_posture(body, examples)
        if self.spread:
            sigma_rad = scaled_spread_rad(body, examples, mean_qpos, self.prior_sigma_rad, _MIN_SPREAD_RAD)
        return PosturePrior(mean_qpos, sigma_rad, self.towards_mean)


PREVIOUS = Ik(
    name="ik:previous",
    summary="ik with a prior about the last estimate, equal for all hinges; learns nothing",
    towards_mean=0.0,
    spread=False,
)
MEAN = Ik(
    name="ik:mean",
    summary="ik with a prior about the examples' mean posture, equal for all hinges",
    towards_mean=1.0,
    spread=False,
)
GAUSSIAN = Ik(
    name="ik:gaussian",
    summary="ik with squared residuals and no outlier gate",
    loss=Loss(robust=False),
    jump_m=math.inf,
)
