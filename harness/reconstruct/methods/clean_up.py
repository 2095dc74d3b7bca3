"""Final inverse kinematics (`+ik`): corrects the estimates of any other method so that they fit the trackers.

For every frame, Levenberg-Marquardt starts from the other method's pose, which is also the mean of the prior of the
hinges. A hinge's standard deviation is in proportion to its spread over the examples, as a method that learns from them
is the more exact the less a hinge moves. Under one wide sigma for all, the noise of readings moved hinges that the
method knew better (docs/notes/tuning.md). The root has no prior. The other method never sees the correction.

An answer to an earlier frame is fitted to the readings of that frame. Its standard deviations are passed on unchanged:
they describe the other method's pose, which the correction moves little.

Source: the last step of Kim et al. 2012 (docs/papers.md B5).

Write `+ik` after a method's name, such as `best_match+ik`. Options (fields of `CleanUp`): `spread_share` 0.5,
`prior_sigma_rad` 30 deg (without examples), the loss of the residuals and the convergence criteria.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.core.ranges import Range
from harness.core.split import declared_training_data
from harness.reconstruct.contract import Method, Reconstructor, Session
from harness.reconstruct.features.posture_statistics import mean_posture, spread_rad
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.solver.frame_reader import SessionReader
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream import TrackerFrame

SUFFIX = "+ik"
"""Suffix of the other method's name."""
_MIN_SPREAD_RAD = math.radians(1.0)
"""Smallest spread of a hinge over the examples that scales its prior."""


@dataclass(frozen=True)
class CleanUp:
    """Options of the final inverse kinematics, a `Method` around another."""

    method: Method
    """The method whose answers are fitted."""
    loss: Loss = field(default_factory=Loss)
    """Scales and robust loss of the residuals."""
    stopping: Stopping = field(default_factory=Stopping)
    """Convergence criteria of the solver."""
    spread_share: Annotated[float, Range(0.0, 1e4)] = 0.5
    """Standard deviation of each hinge about the other method's pose, as a share of its spread over the examples."""
    prior_sigma_rad: Annotated[float, Range(1e-06, 100.0)] = math.radians(30.0)
    """Standard deviation of each hinge about the pose of a method that has no examples [rad]."""
    align: bool = False
    """Move the readings of all stations to one instant first (`temporal_alignment`)."""

    @property
    def name(self) -> str:
        return self.method.name + SUFFIX

    @property
    def summary(self) -> str:
        return f"{self.method.summary}; then fitted to the trackers"

    @property
    def needs_examples(self) -> bool:
        return self.method.needs_examples

    @property
    def training_data(self) -> str:
        return declared_training_data(self.method)

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedCleanUp":
        inner = self.method.fit(body, examples, rng)
        if not self.needs_examples:
            return FittedCleanUp(self, body, inner, np.full(48, self.prior_sigma_rad), StationIncrements(body, ()))
        hinge_spread_rad = spread_rad(body, examples, mean_posture(body, examples))
        sigma_rad = self.spread_share * np.maximum(hinge_spread_rad, _MIN_SPREAD_RAD)
        return FittedCleanUp(self, body, inner, sigma_rad, StationIncrements(body, examples))


@dataclass(frozen=True, eq=False)
class FittedCleanUp:
    """The trained other method, with options and body."""

    options: CleanUp
    body: Body
    inner: Reconstructor
    hinge_sigma_rad: Floats
    """(48,) standard deviations of the prior [rad]."""
    increments: StationIncrements
    """How far stations move in a time."""

    def begin(self, calibration: Calibration) -> "CleanUpSession":
        return CleanUpSession(self, calibration, self.inner.begin(calibration))


class CleanUpSession:
    """Corrects each estimate of the inner session, without feedback to it."""

    def __init__(self, fitted: FittedCleanUp, calibration: Calibration, inner: Session) -> None:
        self._inner = inner
        self._residuals = Residuals(fitted.body, calibration, fitted.options.loss)
        moments = fitted.increments.moments(calibration)
        self._reader = SessionReader(self._residuals, moments, align=fitted.options.align)
        self._limits = HingeLimits(fitted.body)
        self._solver = IKSolver(self._residuals, self._limits, fitted.options.stopping)
        self._precision = np.zeros(self._residuals.kinematics.nv)
        self._precision[6:] = fitted.hinge_sigma_rad**-2
        self._frames: deque[TrackerFrame] = deque()
        """The frame that was answered last, and those after it."""

    def step(self, frame: TrackerFrame) -> Estimate:
        estimate = self._inner.step(frame)
        frame = self._answered_frame(frame, estimate.lag)
        if not (frame.position_valid.any() or frame.orientation_valid.any()):
            return estimate
        self._reader.read(frame)
        start = np.concatenate([estimate.qpos[:7], self._limits.clip(self._limits.principal(estimate.qpos[7:]))])
        qpos = self._solver.solve(start, Prior(start, self._precision)).qpos
        self._reader.update(qpos)
        return Estimate(qpos, estimate.status, estimate.origin, estimate.angle_sigma_rad, estimate.lag)

    def _answered_frame(self, frame: TrackerFrame, lag: int) -> TrackerFrame:
        """The frame so many before this one; ValueError when the session received no such frame, or passed it."""
        self._frames.append(frame)
        if lag >= len(self._frames):
            raise ValueError(f"a lag of {lag} frames, but an answer may go back {len(self._frames) - 1} at most here")
        while len(self._frames) > lag + 1:
            self._frames.popleft()
        return self._frames[0]
