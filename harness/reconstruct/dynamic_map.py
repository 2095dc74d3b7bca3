"""Maximum a posteriori poses under a local dynamic model: Liu et al. 2011, eq. 2 to 14 (docs/methods.md A4, A5, E).

At every frame the windows of the database nearest to the last m answers are found, what followed them is regressed
on them, and the pose is solved that is likely both as what follows and by what the trackers read.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import Take
from harness.errors import BadInput
from harness.reconstruct.coverage import LOST_AFTER_S
from harness.reconstruct.database import MotionDatabase, Windows
from harness.reconstruct.database.ground import HEIGHT, HINGES, POSTURE, ground_of, moved, standing
from harness.reconstruct.gate import JUMP_M
from harness.reconstruct.index import Flat, Index
from harness.reconstruct.local_model import closeness, forecast
from harness.reconstruct.mean_pose import mean_posture
from harness.reconstruct.pursuit import Leaning, Manner, Pursuit
from harness.reconstruct.residuals import Loss
from harness.reconstruct.solver import Prior, Solution, Stopping
from harness.stream.frame import TrackerFrame

_LEANING_RAD = math.radians(30.0)
"""Of hinges about the examples' mean posture, while there is no past to go by [rad]."""


@dataclass(frozen=True)
class DynamicMap:
    """A `Method`."""

    name: str = "dynamic_map"
    summary: str = "the pose that is likely both after the last ones, by a local model of examples, and by the readings"
    needs_examples: bool = True
    poses: int = 2
    """m, answers that the next is predicted from."""
    neighbours: int = 100
    """K, examples of the local model."""
    kept: float = 0.5
    """Share of the windows' variance that the regression uses."""
    ridge: float = 1e-5
    """Added to that variance's eigenvalues, as a share of it."""
    least_sigma_rad: float = math.radians(3.0)
    """Floor of every hinge's standard deviation [rad]."""
    tilt_sigma_rad: float = math.radians(5.0)
    """Of the root's tilt [rad]."""
    height_sigma_m: float = 0.05
    """Of the root's height [m]."""
    step_sigma_m: float = 0.3
    """Of the root's step over the ground [m]."""
    turn_sigma_rad: float = math.radians(10.0)
    """Of its turn about the vertical [rad]."""
    loss: Loss = field(default_factory=Loss)
    jump_m: float = JUMP_M
    """A position that jumps farther than this from where the body carries it is left out for a while; inf never [m]."""
    lost_after_s: float = LOST_AFTER_S
    stopping: Stopping = field(default_factory=Stopping)

    def fit(self, body: Body, examples: Sequence[Take], rng: np.random.Generator) -> "FittedDynamicMap":
        """BadInput without examples that are long enough."""
        windows = MotionDatabase.build(body, examples).windows(self.poses, followed=True)
        if not len(windows):
            found = f"No example has more than {self.poses} frames."
            raise BadInput(found, "Give longer examples, or fewer poses.")
        return FittedDynamicMap(self, body, windows, Flat(windows), mean_posture(body, examples))


@dataclass(frozen=True, eq=False)
class FittedDynamicMap:
    """The windows of the examples and an index of them."""

    options: DynamicMap
    body: Body
    windows: Windows
    index: Index
    mean_qpos: Floats
    """(55,) for starts without a past."""

    def begin(self, calibration: Calibration) -> "DynamicMapSession":
        return DynamicMapSession(self, calibration)


class DynamicMapSession(Pursuit):
    """Remembers its last m answers."""

    def __init__(self, fitted: FittedDynamicMap, calibration: Calibration) -> None:
        options = fitted.options
        manner = Manner(options.loss, True, options.jump_m, options.lost_after_s, options.stopping)
        leaning = Leaning(fitted.mean_qpos, np.full(48, _LEANING_RAD))
        super().__init__(fitted.body, calibration, manner, leaning)
        self._options, self._windows, self._index = options, fitted.windows, fitted.index
        self._past = np.zeros((options.poses, 55))
        """The last answers, newest first."""
        self._known = 0
        self._now_s = -math.inf
        sigma = np.zeros(POSTURE + 3)
        sigma[HINGES] = options.least_sigma_rad
        sigma[1:4], sigma[HEIGHT] = options.tilt_sigma_rad, options.height_sigma_m
        sigma[POSTURE : POSTURE + 2], sigma[-1] = options.step_sigma_m, options.turn_sigma_rad
        self._least_variance = sigma**2

    def followed(self, frame: TrackerFrame) -> Solution:
        if self._known < self._options.poses:
            return super().followed(frame)
        periods = round((frame.received_s - self._now_s) * self._windows.database.rate_hz)
        if not 1 <= periods <= 4:
            self._known = 0
            return super().followed(frame)
        for _ in range(periods - 1):
            self._remember(self._predicted().qpos)
        prior = self._predicted()
        return self.solver.solve(prior.qpos, prior)

    def noted(self, frame: TrackerFrame, anew: bool) -> None:
        self._known = 0 if anew else self._known
        self._remember(self.qpos)
        self._now_s = frame.received_s

    def _remember(self, qpos: Floats) -> None:
        self._past[1:] = self._past[:-1]
        self._past[0] = qpos
        self._known += 1

    def _predicted(self) -> Prior:
        """Eq. 8, on the ground."""
        options, windows = self._options, self._windows
        query = windows.query(self._past)
        rows, squared = self._index.nearest(query, options.neighbours)
        weight = closeness(squared.astype(float), max(float(squared[len(squared) // 2]), 1e-9))
        after = forecast(
            (windows.gather(rows) - query).astype(float),
            windows.successors(rows).astype(float),
            weight,
            options.kept,
            options.ridge,
        )
        mean = standing(after.mean[:POSTURE], moved(ground_of(self._past[0]), after.mean[POSTURE:]))
        mean[7:] = self.limits.clipped(mean[7:])
        variance = after.variance + self._least_variance
        precision = np.empty(54)
        precision[:2] = 1.0 / max(variance[POSTURE], variance[POSTURE + 1])
        precision[2], precision[3:5], precision[5] = 1.0 / variance[HEIGHT], 1.0 / variance[1:3], 1.0 / variance[-1]
        precision[6:] = 1.0 / variance[HINGES]
        return Prior(mean, precision)
