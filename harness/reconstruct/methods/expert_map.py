"""Maximum a posteriori pose under a product of two local experts (`expert_map`).

For every frame:

1. Bring the readings of all stations to one instant (`temporal_alignment`).
2. Put two Gaussians of the posture together from tabulated moments of the examples (`local_experts`): one given the
   readings and the last poses, one given the last poses alone. Multiply them by a broad Gaussian for new performers,
   and by terms of contact (`floor_contact`).
3. Solve for the pose that maximises the product of both and of the likelihood of the readings, by Levenberg-Marquardt.
4. Update the scales of the readings' noise and the trust in the experts from the residuals (`self_calibration`).

Sources: Liu et al. 2011 (prediction times likelihood), Hinton 2002 (product of experts), Atkeson, Moore and Schaal 1997
(locally weighted regression). docs/methods.md has the formulas, the constants and the clips that chose them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, ClassVar

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.estimate import Estimate, Origin
from harness.core.ranges import Range
from harness.reconstruct.contract import CalibrationCache, Session
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.local_experts import LocalExperts
from harness.reconstruct.features.moment_table import condition, local_gaussian
from harness.reconstruct.features.posture_statistics import posture_of_others, toe_height_m
from harness.reconstruct.features.predictor_query import PredictorQuery
from harness.reconstruct.features.reduced_rank_regression import ReducedRankOptions, ReducedRankRegression
from harness.reconstruct.methods.window_method import DatabaseLearner, WindowExamples
from harness.reconstruct.solver.fixed_lag import FixedLagSession
from harness.reconstruct.solver.floor_contact import FloorContact
from harness.reconstruct.solver.ground_frame import (
    HINGES,
    ground_and_posture,
    ground_from_qpos,
    posture_from_qpos,
    qpos_from_posture,
)
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import POSTURE_PRIOR_SIGMA_RAD, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution
from harness.reconstruct.solver.matrix_algebra import invert_positive_definite
from harness.reconstruct.solver.root_placement import candidate_placements
from harness.reconstruct.solver.self_calibration import LossScale, SelfCalibration, Trust, posterior
from harness.reconstruct.solver.subspace import SubspaceSolver
from harness.reconstruct.solver.subspace_minimiser import Subspace
from harness.stream import TrackerFrame

POSES = 3
"""Number of past estimates among the predictors."""
_LEAST_SIGMA_RAD, _LEAST_TILT_RAD, _LEAST_HEIGHT_M = 0.005, 0.01, 0.003
"""Floors of the standard deviations of the experts."""
_RIDGE = 1e-4
"""Ridge of the expert of readings and history, as a share of the features' variance."""
_HISTORY_RIDGE, _HISTORY_WIDTH, _HISTORY_SIGMA_RAD = 0.1, 1.0, math.radians(6.0)
"""Ridge and width of the expert of the history, and a further standard deviation of every hinge under it."""
_STATED_AT_36, _STATED_POWER = 0.92, 0.4
"""Stated standard deviations over those of the posterior, for the 36 numbers of six stations; and the power by which
the factor grows with fewer numbers. The posterior is too narrow in hinges that no station shows."""
_STATED_BY_CALIBRATION = {"tpose": 1.5, "poses": 1.27, "liu2011": 1.45, "kim2012": 2.0}
"""Further factor of calibrations whose mounts err."""
FEATURES = 32
"""Number of features of readings and history."""

_LAG_WEIGHTS = {1: (0.15, 0.7, 0.15), 2: (0.02, 0.14, 0.68, 0.14, 0.02)}
"""Weights of the poses for each fixed lag. The jitter is then about that of true motion."""


Gaussian = tuple[Floats, Floats]
"""Mean (P,) and covariance (P, P) of a posture."""


@dataclass(frozen=True)
class ExpertMap(DatabaseLearner["FittedExpertMap"]):
    """Options of the product of local experts, a `Method`."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {
        "widening": "Leave it out: the readings show how much a performer differs from the examples."
    }

    name: str = "expert_map"
    summary: str = "maximum a posteriori pose under tabulated local experts, with self-calibrated noise"
    fewest_frames = POSES + 1
    neighbours: Annotated[int, Range(2, 1_000_000)] = 1800
    """K: number of examples in the local model of readings and history."""
    history_neighbours: Annotated[int, Range(2, 1_000_000)] = 400
    """K of the local model of the history alone."""
    width: Annotated[float, Range(1e-06, 1e6)] = 0.1
    """Variance of the weights over the squared distance within which half of the K examples lie."""
    history_weight: Annotated[float, Range(0.0, 1e3)] = 0.5
    """Power of the expert of the history in the product; 0 leaves it out."""
    broad_weight: Annotated[float, Range(0.0, 1e3)] = 0.15
    """Power of the broad Gaussian of other performers' postures in the product, for a performer unlike the examples."""
    align: bool = True
    """Move the readings of all stations to one instant."""
    lag: Annotated[int, Range(0, 2)] = 0
    """Fixed lag [frames]: answers are smoothed over this many frames before and after."""
    jump_m: Annotated[float, Range(0.0, math.inf)] = 0.1
    """Outlier gate: a position this far from its prediction is left out for a while [m]; inf disables the gate."""

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedExpertMap":
        """Learn from a database, which may lie on disk."""
        examples = WindowExamples.learn(body, database, POSES)
        return FittedExpertMap(self, examples, toe_height_m(body, database), posture_of_others(database))


@dataclass(frozen=True, eq=False)
class FittedExpertMap:
    """The windows of the examples, and the experts for the last calibration."""

    options: ExpertMap
    examples: WindowExamples
    floor_m: float
    """Height of a toe on the floor [m]."""
    broad: tuple[Floats, Floats]
    """Mean (52,) and variance (52,) of the posture of a performer whom the examples lack."""
    _cache: CalibrationCache[tuple[ReducedRankRegression, dict[int, LocalExperts]]] = field(
        default_factory=CalibrationCache
    )

    def begin(self, calibration: Calibration) -> Session:
        causal = ExpertMapSession(self, calibration, *self._trained(calibration))
        return FixedLagSession(causal, _LAG_WEIGHTS[self.options.lag]) if self.options.lag else causal

    def _trained(self, calibration: Calibration) -> tuple[ReducedRankRegression, dict[int, LocalExperts]]:
        """The regression for the mounts of a calibration, and its experts by the identity of their regression."""

        def make() -> tuple[ReducedRankRegression, dict[int, LocalExperts]]:
            examples, options = self.examples, ReducedRankOptions(directions=FEATURES)
            regression = ReducedRankRegression(examples.body, examples.windows, calibration, options)
            return regression, {id(regression): LocalExperts(regression)}

        return self._cache.get(calibration, make)


class ExpertMapSession(HistorySession):
    """Follows one performer."""

    def __init__(
        self,
        fitted: FittedExpertMap,
        calibration: Calibration,
        regression: ReducedRankRegression,
        experts: dict[int, LocalExperts],
    ) -> None:
        options, examples = fitted.options, fitted.examples
        solver_options = SolverOptions(jump_m=options.jump_m, align=options.align)
        loss, rate_hz = solver_options.loss, examples.windows.database.rate_hz
        super().__init__(
            *(examples.body, calibration, solver_options, examples.mean_prior, examples.increments.moments),
            *(POSES, rate_hz),
        )
        self._options, self._broad, self._made = options, fitted.broad, experts
        self._stated = _STATED_BY_CALIBRATION.get(calibration.kind, 1.0)
        self._query = PredictorQuery(regression, self.residuals)
        self._experts = experts[id(regression)]
        self._solver = SubspaceSolver(self.residuals, self.limits, solver_options.stopping)
        self._no_noise = np.zeros((self._experts.history_axes.shape[1],) * 2)
        self._contact = FloorContact(examples.body, self.residuals, fitted.floor_m, rate_hz)
        self._scales = SelfCalibration(loss.position_sigma_m, loss.orientation_sigma_rad)
        self._loss_scale, self._trust = LossScale(loss.position_scale_m, rate_hz), Trust(rate_hz)
        self._product: Gaussian
        """Mean (P,) and precision (P, P) of the product of the experts."""
        self._prior: Subspace | None = None
        """Prior of the pose that was solved last; None when inverse kinematics answered."""
        self._angle_sigma_rad: Floats = np.full(48, POSTURE_PRIOR_SIGMA_RAD)
        """(48,) standard deviation of each hinge angle in the last answer."""

    def step(self, frame: TrackerFrame) -> Estimate:
        self.residuals.set_sigma(self._scales.position_sigma_m, self._scales.orientation_sigma_rad)
        self.residuals.set_position_scale(self._loss_scale.position_m)
        estimate = super().step(frame)
        return Estimate(estimate.qpos, estimate.status, estimate.origin, self._angle_sigma_rad)

    def solve_next(self) -> IKSolution:
        self._prior = prior = self._predict(history=True)
        ground = self._next_ground()
        solve = partial(self._solver.solve, prior, ground)
        return self.solve_from_either(solve, prior.mean, posture_from_qpos(self.past[0]))

    def solve_cold(self) -> IKSolution:
        """The best pose under the expert of the readings, where they suffice; else by inverse kinematics."""
        by_ik = super().solve_cold()
        self._prior = None
        if not self._query.readings_suffice():
            return by_ik
        self.cold_origin = Origin.MODEL
        self._prior = prior = self._predict(history=False)
        posture = qpos_from_posture(prior.mean, np.zeros(3))
        starts = [by_ik.qpos, *candidate_placements(self.residuals, posture)]
        return self.cheapest_in_subspace(self._solver, prior, starts)

    def solve_without_history(self, frame: TrackerFrame) -> IKSolution:
        """As `solve_cold`, but from the last estimate's place alone."""
        if not self._query.readings_suffice():
            self._prior = None
            return super().solve_without_history(frame)
        self._prior = prior = self._predict(history=False)
        return self._solver.solve(prior, ground_from_qpos(self.qpos), posture_from_qpos(self.qpos))

    def predict_gap(self) -> Floats:
        prior = self._predict(history=True)
        posture = prior.mean.copy()
        posture[HINGES] = self.limits.clip(posture[HINGES])
        out: Floats = qpos_from_posture(posture, self._next_ground())
        return out

    def record(self, frame: TrackerFrame, cold: bool) -> None:
        super().record(frame, cold)
        self._query.record()
        self._contact.record(self.qpos)
        if self._prior is None:
            self._angle_sigma_rad = np.full(48, POSTURE_PRIOR_SIGMA_RAD)
            return
        residuals, prior = self.residuals, self._prior
        residuals.evaluate(self.qpos)
        z = ground_and_posture(self.qpos)
        found = posterior(residuals.tree, residuals.targets, residuals.state, prior, self._product, z)
        self._angle_sigma_rad = self._stated_factor() * np.sqrt(found.variance[HINGES])
        if not cold:
            self._scales.update(found)
            self._trust.update(found)
            if not residuals.variance.any():
                self._loss_scale.update(residuals.targets, residuals.state)

    def _stated_factor(self) -> float:
        """Stated standard deviations over those of the posterior, for the readings that the session has had."""
        numbers = 3 * max(int(self._query.usual.sum()), 1)
        return self._stated * _STATED_AT_36 * math.pow(36.0 / numbers, _STATED_POWER)

    def _next_ground(self) -> Floats:
        """Ground frame (3,) after the last two, at the same speed."""
        return _extrapolate_ground(self.past[0], self.past[1])

    def _predict(self, history: bool) -> Subspace:
        """The product of the experts, of contact with the floor and, for new performers, of the broad Gaussian."""
        options, query = self._options, self._query
        if query.prepare(history):
            regression = query.regression
            if id(regression) not in self._made:
                self._made[id(regression)] = LocalExperts(regression)
            self._experts = self._made[id(regression)]
        experts, scales, trust = self._experts, self._scales, self._trust
        predictors = query.predictors(self.past)
        to_z = experts.feature_map(self.residuals.measured, history)
        sigma = scales.position_sigma_m, scales.orientation_sigma_rad
        noise = to_z.error_covariance(*sigma, self.residuals.variance)
        z = predictors @ to_z.matrix - to_z.origin
        local = local_gaussian(experts.table, z, options.neighbours, options.width)
        mean, covariance = condition(local, z, noise, _RIDGE)
        mean[HINGES] = self.limits.clip(mean[HINGES])
        other, power = (mean, covariance), 0.0
        if history and options.history_weight > 0.0:
            u = predictors[: len(experts.history_axes)] @ experts.history_axes - experts.history_origin
            around = local_gaussian(experts.history_table, u, options.history_neighbours, _HISTORY_WIDTH)
            other = condition(around, u, self._no_noise, _HISTORY_RIDGE)
            power = options.history_weight / math.sqrt(trust.inflation)
        self._product = _multiply((mean, covariance), trust.inflation, other, power)
        prior = _multiply_broad(self._product, self._broad, options.broad_weight * trust.newness)
        return self._contact.constrain(prior, self._next_ground(), history)


@compiled
def _extrapolate_ground(newest: Floats, before: Floats) -> Floats:
    """Ground frame (3,) one step after those of two configurations (55,), at the same speed."""
    ground, turn = np.empty(3), 2.0 * np.arctan2(newest[6], newest[3])
    change = turn - 2.0 * np.arctan2(before[6], before[3])
    ground[0], ground[1] = 2.0 * newest[0] - before[0], 2.0 * newest[1] - before[1]
    ground[2] = turn + change - 2.0 * np.pi * np.round(change / (2.0 * np.pi))
    return ground


@compiled
def _multiply(expert: Gaussian, inflation: float, other: Gaussian, power: float) -> Gaussian:
    """Mean (P,) and precision (P, P) of the product of an inflated Gaussian with a power of another.

    The covariances (P, P) are overwritten.
    """
    mean, covariance = expert
    other_mean, other_covariance = other
    _add_floor(covariance, 0.0)
    covariance *= inflation
    precision = invert_positive_definite(covariance)
    if power > 0.0:
        _add_floor(other_covariance, _HISTORY_SIGMA_RAD**2)
        inverse = invert_positive_definite(other_covariance)
        precision += power * inverse
        mean = mean + np.linalg.solve(precision, power * np.dot(inverse, other_mean - mean))
    return mean, precision


@compiled
def _multiply_broad(product: Gaussian, broad: Gaussian, power: float) -> Subspace:
    """The prior: a Gaussian of this mean and precision, times a power of one of independent numbers.

    `broad` are the mean (P,) and the variance (P,) of the other one.
    """
    mean, precision = product[0], product[1].copy()
    if power > 0.0:
        added = power / broad[1]
        for i in range(len(mean)):
            precision[i, i] += added[i]
        mean = mean + np.linalg.solve(precision, added * (broad[0] - mean))
    return Subspace(mean, np.zeros((0, len(mean))), precision, np.zeros(len(mean)), np.zeros(len(mean)))


@compiled
def _add_floor(covariance: Floats, hinges: float) -> None:
    """Add the least variances to the diagonal of a posture's covariance (P, P), and `hinges` to those of hinges."""
    covariance[0, 0] += _LEAST_HEIGHT_M**2
    for i in range(1, 4):
        covariance[i, i] += _LEAST_TILT_RAD**2
    for i in range(4, len(covariance)):
        covariance[i, i] += _LEAST_SIGMA_RAD**2 + hinges
