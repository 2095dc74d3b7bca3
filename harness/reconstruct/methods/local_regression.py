"""Local regression: the steps that `kernel_cca` and `weighted_blend` have in common (docs/papers.md B).

For every frame (Kim et al. 2012):

1. Compute the features of the readings: positions, velocities and orientations relative to one station on the trunk.
2. Find the k examples of the nearest features (eq. 2), and add those of the frame before.
3. Compute a weight for each neighbour (`weigh`): the only step in which the two methods differ.
4. Blend the neighbours' postures and root placements by these weights.
5. Smooth over three frames (eq. 6).
6. Fit the pose to the trackers by inverse kinematics.

Ours: features relative to an anchor station instead of the room, weights by the readings' confidence, the outlier gate,
and whole-body inverse kinematics with a prior about the regressed pose (`solve` "limbs" is closed-form limb IK).

The options are the fields of `LocalRegression`, and each method adds its own.

Weighted blend (`weighted_blend`, docs/papers.md C3) weighs neighbours by a power of their distance in feature space. It
is the baseline of Kim et al. 2012, which prints no weights; the power is ours. scenarios/tune_weighted_blend.toml chose
`neighbours` 16 and `power` 4.
"""

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Literal

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.estimate import Estimate, Origin
from harness.core.ranges import Range
from harness.reconstruct.contract import CalibrationCache
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.example_features import ExampleFeatures, FeatureWeights, Query
from harness.reconstruct.features.pose_space import HingeAngles, JointQuaternions, PoseSpace
from harness.reconstruct.features.posture_statistics import mean_posture, scaled_spread_rad
from harness.reconstruct.features.query_features import LONGEST_GAP_ADVICE, LONGEST_GAP_S, QueryFeatures
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.methods.window_method import DatabaseLearner
from harness.reconstruct.solver.frame_reader import SessionReader
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE, qpos_from_posture, step_ground
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
from harness.reconstruct.solver.limb_solver import LimbSolver
from harness.reconstruct.solver.outlier_gate import JUMP_M
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.stream import TrackerFrame

_MIN_SPREAD_RAD = math.radians(1.0)
"""Smallest spread of a hinge over the examples that scales its prior."""
_JUMP_WITHOUT_IK_M = 0.3
"""Outlier gate without inverse kinematics [m], as for the best match: the pose is farther from the readings."""

_ROOT_SIGMA_M, _ROOT_SIGMA_RAD = 0.1, math.radians(10.0)
"""Standard deviations of the root about the regressed one [m, rad]."""
_HINGE_SIGMA_RAD = math.radians(30.0)
"""RMS of the hinges' standard deviations about the regressed pose [rad]."""
_MOST_STEPS = 4
"""Largest number of Levenberg-Marquardt steps."""
_NO_ROWS: Ints = np.zeros(0, np.int64)


@dataclass(frozen=True)
class LocalRegression(DatabaseLearner["FittedLocalRegression"]):
    """Options that both methods share. A method adds its own options and `weigh`."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(
            ("root_sigma_m", "root_sigma_rad", "hinge_sigma_rad"), "Leave it out: the widths of the prior are fixed."
        ),
        "most_steps": "Leave it out: inverse kinematics takes at most 4 steps.",
        "longest_gap_s": LONGEST_GAP_ADVICE,
    }

    name: str
    summary: str
    neighbours: Annotated[int, Range(1, 1_000_000)] = 8
    """k of eq. 2: neighbours of a frame; those of the frame before are added."""
    weights: FeatureWeights = field(default_factory=FeatureWeights)
    """Weights of positions, velocities and orientations in eq. 2."""
    index: str = "auto"
    """Search index: "auto" or a name of `index.selection`."""
    jump_m: Annotated[float, Range(0.0, math.inf)] = JUMP_M
    """Outlier gate: a position this far from its prediction is left out for a while [m]; inf disables the gate."""
    align: bool = False
    """Move the readings of all stations to one instant before anything else uses them (`temporal_alignment`)."""
    alpha: Annotated[float, Range(0.0, 1.0)] = 0.3
    """alpha of eq. 6: share of the frame before last in the blend of the last two."""
    beta: Annotated[float, Range(0.0, 1.0)] = 0.4
    """beta of eq. 6: share of the last two frames; 0 disables smoothing."""
    outputs: Literal["angles", "quaternions"] = "angles"
    """Coordinates in which poses are blended and smoothed: hinge angles, or the joints' quaternions (the paper)."""
    final_ik: bool = True
    """Whether inverse kinematics follows; without it only the root is fitted to the trackers."""
    solve: Literal["body", "limbs"] = "body"
    """Inverse kinematics: "body" takes a few Levenberg-Marquardt steps, "limbs" solves limbs in closed form."""
    spread: bool = True
    """Whether each hinge's standard deviation is proportional to its spread over the examples; else all are equal."""

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedLocalRegression":
        """Learn from a database, which may lie on disk."""
        sigma_rad = np.full(48, _HINGE_SIGMA_RAD)
        if self.spread:
            centre = mean_posture(body, database)
            sigma_rad = scaled_spread_rad(body, database, centre, _HINGE_SIGMA_RAD, _MIN_SPREAD_RAD)
        return FittedLocalRegression(self, body, database, sigma_rad, StationIncrements(body, database))

    @abstractmethod
    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        """(m,) weights of sum 1 for m >= 2 neighbours: outputs (m, d), inputs (m, n) and the query (n,)."""


@dataclass(frozen=True, eq=False)
class FittedLocalRegression:
    """The examples; their features depend on the mounts and are cached per calibration."""

    options: LocalRegression
    body: Body
    database: MotionDatabase
    hinge_sigma_rad: Floats
    """(48,) standard deviations of the prior [rad]."""
    increments: StationIncrements
    """How far stations move in a time."""
    cache: CalibrationCache[ExampleFeatures] = field(default_factory=CalibrationCache, repr=False)

    def begin(self, calibration: Calibration) -> "LocalRegressionSession":
        self.database.release_memory()  # pages that earlier sessions read
        return LocalRegressionSession(self, calibration)

    def example_features(self, calibration: Calibration) -> ExampleFeatures:
        """Features of the examples for the mounts of a calibration; cached."""
        options, weights = self.options, self.options.weights
        if self.database.rate_hz * LONGEST_GAP_S < 1.0:
            weights = replace(weights, velocity=0.0)  # no example has a frame that shortly before it
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
        moments = fitted.increments.moments(calibration)
        self._reader = SessionReader(self._residuals, moments, jump_m, align=options.align)
        self._examples = fitted.example_features(calibration)
        self._lookup = self._examples.index.begin_search()
        self._features = QueryFeatures(self._residuals, calibration, self._examples, self._reader.clock)
        self._limits = HingeLimits(fitted.body)
        self._space: PoseSpace = HingeAngles()
        if options.outputs == "quaternions":
            self._space = JointQuaternions(fitted.body, self._limits)
        self._solver = IKSolver(self._residuals, self._limits, Stopping(most_steps=_MOST_STEPS))
        self._limbs = LimbSolver(fitted.body, calibration.bones, self._residuals, self._limits)
        self._precision = np.repeat([_ROOT_SIGMA_M**-2, _ROOT_SIGMA_RAD**-2], 3)
        self._precision = np.concatenate([self._precision, fitted.hinge_sigma_rad**-2])
        self._estimate = fitted.database.qpos(np.array([0]), np.zeros(3))[0]
        self._last_rows = _NO_ROWS
        self._last_poses: list[Floats] = []

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_valid = self._reader.read(frame)
        if not any_valid:
            self._last_rows, self._last_poses = _NO_ROWS, []
            return Estimate(self._estimate, status, Origin.BRIDGED)
        if not np.count_nonzero(self._residuals.measured):
            return Estimate(self._estimate, status, Origin.BRIDGED)
        query = self._features.compute(frame, self._estimate)
        pose = self._space.decode(self._smooth(self._regress(query)))
        self._estimate = self._fit_to_trackers(
            qpos_from_posture(pose[:POSTURE_SIZE], step_ground(np.array(query.view), pose[POSTURE_SIZE:]))
        )
        self._reader.update(self._estimate)
        return Estimate(self._estimate, status)

    def _regress(self, query: Query) -> Floats:
        """(d,) posture and root placement in `_space`, regressed on the neighbours of this frame and the last."""
        rows = self._examples.nearest(query, self._options.neighbours, self._lookup)
        inputs, regression_query, outputs = self._examples.regression_data(
            rows, self._last_rows, query.features, query.confidence
        )
        self._last_rows = rows
        coordinates = self._space.encode(outputs)
        if len(coordinates) == 1:
            return coordinates.reshape(-1)
        return self._space.blend(self._options.weigh(inputs, regression_query, coordinates), coordinates)

    def _smooth(self, pose: Floats) -> Floats:
        """Eq. 6 on the posture and on the root relative to the anchor, so that walking is not delayed."""
        if len(self._last_poses) == 2:
            second_last, last = self._last_poses
            pose = self._space.smooth(pose, last, second_last, self._options.alpha, self._options.beta)
        self._last_poses = [*self._last_poses[-1:], pose]
        return pose

    def _fit_to_trackers(self, qpos: Floats) -> Floats:
        """(55,) the configuration after inverse kinematics, or with the root fitted when `final_ik` is off."""
        qpos[7:] = self._limits.clip(qpos[7:])
        if not np.count_nonzero(self._residuals.measured[: self._examples.count]):
            qpos[:2] = self._estimate[:2]  # orientations alone give no position: keep the last one
        if self._options.final_ik and self._options.solve == "limbs":
            return self._limbs.solve(qpos)
        if self._options.final_ik:
            return self._solver.solve(qpos, Prior(qpos, self._precision)).qpos
        return place_root(self._residuals, qpos)


@dataclass(frozen=True)
class WeightedBlend(LocalRegression):
    """Options of the weighted blend, a `Method`."""

    name: str = "weighted_blend"
    summary: str = "nearest examples weighted by inverse distance, smoothed, then fitted to the trackers"
    neighbours: Annotated[int, Range(1, 1_000_000)] = 16
    """k of eq. 2: neighbours of a frame; those of the frame before are added."""
    power: Annotated[float, Range(0.0, 100.0)] = 4.0
    """Exponent of the weights, distance^-power."""

    def weigh(self, inputs: Floats, query: Floats, outputs: Floats) -> Floats:
        return _inverse_distance_weights(inputs, query, self.power)


LITERAL = WeightedBlend(
    "weighted_blend:literal",
    "the baseline of Kim et al. 2012: 8 neighbours by inverse distance, with the steps of kernel_cca:literal",
    neighbours=8,
    index="kd_tree",
    jump_m=math.inf,
    outputs="quaternions",
    power=1.0,
)
"""The paper names the baseline and prints no weights; inverse distance is the plainest choice: docs/methods.md."""


@compiled
def _inverse_distance_weights(inputs: Floats, query: Floats, power: float) -> Floats:
    """(m,) weights distance^-power of inputs (m, n) for a query (n,), of sum 1."""
    out: Floats = np.empty(len(inputs))
    for i in range(len(inputs)):
        squared = 0.0
        for k in range(len(query)):
            squared += (inputs[i, k] - query[k]) ** 2
        out[i] = max(squared, 1e-12) ** (-0.5 * power)
    out /= out.sum()
    return out
