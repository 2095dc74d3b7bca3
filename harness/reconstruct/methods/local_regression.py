"""What the two methods of Kim et al. 2012 have in common: all but how neighbours become a pose (docs/methods.md B).

At every frame: the k examples in which the trackers read most like now (eq. 2), together with those of the frame
before; one weight for each of them, which is where the methods differ; the weighted pose; the blend of three frames
(eq. 6); and inverse kinematics onto the trackers.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.features.calibration_cache import CalibrationCache
from harness.reconstruct.features.example_features import ExampleFeatures, FeatureWeights
from harness.reconstruct.features.ground_step import step_ground
from harness.reconstruct.features.query_features import QueryFeatures
from harness.reconstruct.features.smoothing import smooth
from harness.reconstruct.methods.mean_pose import mean_posture, spread_rad
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE, qpos_from_posture
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
from harness.reconstruct.solver.limb_solver import LimbSolver
from harness.reconstruct.solver.outlier_gate import JUMP_M, OutlierGate
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream.frame import TrackerFrame

_MIN_SPREAD_RAD = math.radians(1.0)
"""A hinge that rests in all examples may still give way a little."""
_JUMP_WITHOUT_IK_M = 0.3
"""The gate without inverse kinematics, as for the best match: a learnt pose is never as near as a fitted one."""

_NO_ROWS: Ints = np.zeros(0, np.int64)


@dataclass(frozen=True)
class LocalRegression(ABC):
    """Options that both methods share; each adds its own, and `weigh`."""

    name: str
    summary: str
    needs_examples: bool = True
    neighbours: int = 8
    """k of eq. 2, for this frame; those of the frame before are kept as well."""
    weights: FeatureWeights = field(default_factory=FeatureWeights)
    """Of eq. 2."""
    index: str = "auto"
    """What neighbours are sought in (`index.choose`)."""
    longest_gap_s: float = 0.2
    """A velocity is taken between readings, or examples, no farther apart [s]."""
    jump_m: float = JUMP_M
    """A position that jumps farther than this from where the body carries it is left out for a while; inf never [m]."""
    alpha: float = 0.3
    beta: float = 0.4
    """Of eq. 6; beta = 0 blends nothing."""
    final_ik: bool = True
    """Off, the pose is only stood where the trackers are."""
    solve: Literal["body", "limbs"] = "body"
    """Inverse kinematics: a few steps on the whole body, from and towards what was regressed, or in closed form."""
    root_sigma_m: float = 0.1
    root_sigma_rad: float = math.radians(10.0)
    hinge_sigma_rad: float = math.radians(30.0)
    """How freely inverse kinematics may leave what was regressed [m, rad]; of the hinges it is the root mean square."""
    spread: bool = True
    """Whether each hinge's own follows its spread over the examples, as for `ik`; else all have the same."""
    most_steps: int = 4
    """Of that on the whole body."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedLocalRegression":
        """BadInput without examples."""
        if not any(len(take) for take in examples):
            raise BadInput("A local regression learns from examples, and there are none.", "Name some in the scenario.")
        return self.fit_database(body, MotionDatabase.build(body, examples), rng)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedLocalRegression":
        """From a database that may lie on disk."""
        sigma_rad = np.full(48, self.hinge_sigma_rad)
        if self.spread:
            own = np.maximum(spread_rad(body, database, mean_posture(body, database)), _MIN_SPREAD_RAD)
            sigma_rad *= own / np.sqrt(np.mean(own**2))
        return FittedLocalRegression(self, body, database, sigma_rad)

    @abstractmethod
    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        """(m,) weights, of sum 1, of m >= 2 outputs (m, 55), for inputs (m, n) and a query (n,)."""


@dataclass(frozen=True, eq=False)
class FittedLocalRegression:
    """The examples."""

    options: LocalRegression
    body: Body
    database: MotionDatabase
    hinge_sigma_rad: Floats
    """(48,)"""
    cache: CalibrationCache[ExampleFeatures] = field(default_factory=CalibrationCache, repr=False)

    def begin(self, calibration: Calibration) -> "LocalRegressionSession":
        self.database.release_memory()  # what the sessions before have read
        return LocalRegressionSession(self, calibration)

    def example_features(self, calibration: Calibration) -> ExampleFeatures:
        """What trackers worn so would have read in the examples."""
        options, weights = self.options, self.options.weights
        if self.database.rate_hz * options.longest_gap_s < 1.0:
            weights = replace(weights, velocity=0.0)  # no example has a frame near enough before it
        return self.cache.get(
            calibration,
            lambda: ExampleFeatures(self.body, self.database, calibration, weights, options.index, options.neighbours),
        )


class LocalRegressionSession:
    """Follows one performer."""

    def __init__(self, fitted: FittedLocalRegression, calibration: Calibration) -> None:
        options = self._options = fitted.options
        self._residuals = Residuals(fitted.body, calibration, Loss())
        jump_m = options.jump_m if options.final_ik else max(options.jump_m, _JUMP_WITHOUT_IK_M)
        self._coverage, self._gate = StatusMonitor(), OutlierGate(len(calibration.stations), jump_m)
        self._examples = fitted.example_features(calibration)
        self._outlook = QueryFeatures(self._residuals, calibration, self._examples, options.longest_gap_s)
        self._limits = HingeLimits(fitted.body)
        self._solver = IKSolver(self._residuals, self._limits, Stopping(most_steps=options.most_steps))
        self._limbs = LimbSolver(fitted.body, calibration.bones, self._residuals, self._limits)
        self._precision = np.repeat([options.root_sigma_m**-2, options.root_sigma_rad**-2], 3)
        self._precision = np.concatenate([self._precision, fitted.hinge_sigma_rad**-2])
        self._answer = fitted.database.qpos(np.array([0]), np.zeros(3))[0]
        self._rows_before = _NO_ROWS
        self._poses_before: list[Floats] = []

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.update(frame)
        if not any_seen:
            self._rows_before, self._poses_before = _NO_ROWS, []
            return Estimate(self._answer, status)
        self._gate.read(frame, self._residuals)
        if not np.count_nonzero(self._residuals.measured):
            return Estimate(self._answer, status)
        view, query, trust = self._outlook.compute(frame, self._answer)
        pose = self._smoothed(self._regressed(query, trust))
        self._answer = self._fitted_to_trackers(
            qpos_from_posture(pose[:POSTURE_SIZE], step_ground(np.array(view), pose[POSTURE_SIZE:]))
        )
        self._gate.update(self._residuals, self._answer)
        return Estimate(self._answer, status)

    def _regressed(self, query: Floats, trust: Floats) -> Floats:
        """(55,) what is learnt (`ExampleFeatures.pairs`), from the neighbours of this frame and the last."""
        rows = self._examples.nearest(query, trust, self._options.neighbours)
        inputs, asked, outputs = self._examples.regression_data(rows, self._rows_before, query, trust)
        self._rows_before = rows
        if len(outputs) == 1:
            return outputs.reshape(-1)
        pose: Floats = np.matmul(self._options.weigh(inputs, asked, outputs), outputs)
        return pose

    def _smoothed(self, pose: Floats) -> Floats:
        """Eq. 6, on hinge angles and on the root as seen from the anchor, so that walking itself is not delayed."""
        if len(self._poses_before) == 2:
            earlier, before = self._poses_before
            pose = smooth(pose, before, earlier, self._options.alpha, self._options.beta)
        self._poses_before = [*self._poses_before[-1:], pose]
        return pose

    def _fitted_to_trackers(self, qpos: Floats) -> Floats:
        qpos[7:] = self._limits.clip(qpos[7:])
        if not np.count_nonzero(self._residuals.measured[: self._examples.count]):
            qpos[:2] = self._answer[:2]  # orientations alone do not say where: stay
        if self._options.final_ik and self._options.solve == "limbs":
            return self._limbs.solve(qpos)
        if self._options.final_ik:
            return self._solver.solve(qpos, Prior(qpos, self._precision)).qpos
        return place_root(self._residuals, qpos)
