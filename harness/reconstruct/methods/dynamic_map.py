"""Local dynamic model (`dynamic_map`): maximum a posteriori poses (docs/papers.md A4, A5, E).

For every frame:

1. Search the K example windows that are most like the present.
2. Regress the posture and step that follow them on the windows (`local_dynamic_model`): a Gaussian prediction.
3. Solve for the pose that maximises prediction times likelihood of the readings, by Levenberg-Marquardt.

Source: Liu et al. 2011, eq. 2 to 14. Three variants:

- `dynamic_map:literal`: the equations as printed. Windows are compared by the last m estimates, D_w of eq. 6 is the
  identity, sigma_d is that of the residuals without a factor, and the solver starts at the closest example.
- `dynamic_map:window`: the same search, with a ridge in place of cut-off components, wider weights and sigmas.
- `dynamic_map` (ours): readings take part in the search and in the regression, by features from a reduced-rank
  regression (`reduced_rank_regression`). A prediction from its own estimates alone drifts with its errors. The prior
  has the full covariance of the residuals, so that unobserved hinges follow the observed ones.

Options are the fields of `DynamicMap`. docs/methods.md has a table of the defaults; docs/notes/tuning.md says how
scenarios/tune_dynamic_map.toml and other validation clips chose them. `regression` holds the options of the features.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.estimate import LOST_AFTER_ADVICE, Origin
from harness.core.ranges import Range
from harness.reconstruct.contract import CalibrationCache
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.predictor_query import FeatureSearch, NeighbourSearch, PoseHistorySearch
from harness.reconstruct.features.reduced_rank_regression import ReducedRankOptions, ReducedRankRegression
from harness.reconstruct.index.protocol import Index
from harness.reconstruct.index.selection import make_index
from harness.reconstruct.methods.local_dynamic_model import forecast, neighbour_weights
from harness.reconstruct.methods.window_method import DatabaseLearner, WindowExamples
from harness.reconstruct.solver.ground_frame import (
    HEIGHT,
    HINGES,
    POSTURE_SIZE,
    TILT,
    ground_after_step,
    posture_from_qpos,
    qpos_from_posture,
)
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution, Prior, multiply_priors
from harness.reconstruct.solver.outlier_gate import JUMP_M
from harness.reconstruct.solver.residuals import Loss
from harness.reconstruct.solver.root_placement import candidate_placements
from harness.reconstruct.solver.subspace import SubspaceSolver, gaussian_space
from harness.reconstruct.solver.subspace_minimiser import Subspace
from harness.stream import TrackerFrame

_MIN_WEIGHT_VARIANCE = 1e-6
"""Smallest variance of the neighbours' weights, for a performer who repeats an example exactly."""


@dataclass(frozen=True)
class DynamicMap(DatabaseLearner["FittedDynamicMap"], SolverOptions):
    """Options of the local dynamic model, a `Method`; scenarios/tune_dynamic_map.toml chose the defaults."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {
        "terms": "regression",
        "like": "search",
        "kept": "variance_kept",
        "novelty": "widening",
        "lost_after_s": LOST_AFTER_ADVICE,
    }

    name: str = "dynamic_map"
    summary: str = "maximum a posteriori pose under a local dynamic model of examples, found by history and readings"
    search: Literal["features", "history"] = "features"
    """Search of the neighbours: by the last estimates and the readings, or by the last estimates alone (the paper)."""
    regression: ReducedRankOptions = field(default_factory=ReducedRankOptions)
    """Options of the reduced-rank regression that makes the features; used when `search` is "features"."""
    poses: Annotated[int, Range(1, 100)] = 3
    """m: number of past estimates from which the next pose is predicted."""
    neighbours: Annotated[int, Range(2, 1_000_000)] = 800
    """K: number of examples in the local model."""
    width: Annotated[float, Range(1e-06, 1e6)] = 0.2
    """Variance of the weights over the K/2-th neighbour's squared distance; 0 is eq. 6 as printed, D_w = 1."""
    variance_kept: Annotated[float, Range(1e-06, 1.0)] = 1.0
    """Share of the windows' variance that the regression uses (eq. 5); 1 keeps all and relies on the ridge."""
    ridge: Annotated[float, Range(0.0, 1e6)] = 0.1
    """Ridge added to the eigenvalues of the windows' covariance, as a share of its trace."""
    covariance: Literal["full", "diagonal"] = "full"
    """Covariance of the prediction: that of the regression's residuals, or its diagonal alone (the paper, eq. 8)."""
    spread: Annotated[float, Range(1e-06, 1e6)] = 3.0
    """Factor on the standard deviations of the prediction, which allows for another performer than the examples'.

    At 1 the prior is so narrow that it pulls the body off exact trackers."""
    widening: Annotated[float, Range(0.0, 1e6)] = 100.0
    """For performers unlike the examples, the covariance grows by the factor f = 1 + (widening d^2)^2, where d is the
    RMS distance of the nearest example per column of the query; 0 for no growth."""
    ik_prior_weight: Annotated[float, Range(0.0, 1e6)] = 1.0
    """The prior of `ik` takes part with the weight `ik_prior_weight` (1 - 1/f); 0 leaves it out."""
    least_sigma_rad: Annotated[float, Range(0.0, 100.0)] = math.radians(1.0)
    """Floor of every hinge's standard deviation [rad]."""
    tilt_sigma_rad: Annotated[float, Range(1e-06, 100.0)] = math.radians(3.0)
    """Floor of the root's tilt, standard deviation [rad]."""
    height_sigma_m: Annotated[float, Range(1e-06, 100.0)] = 0.02
    """Floor of the root's height, standard deviation [m]."""
    step_sigma_m: Annotated[float, Range(1e-06, 100.0)] = 3.0
    """Floor of the root's step over the ground, standard deviation [m]; a small one makes a slip permanent.

    With a full covariance neither the step nor the turn has a prior."""
    turn_sigma_rad: Annotated[float, Range(1e-06, 100.0)] = math.radians(60.0)
    """Floor of the root's rotation about the vertical per frame, standard deviation [rad]."""
    start: Literal["prediction", "closest"] = "prediction"
    """Start of the solver. "closest" is the closest example (the paper). "prediction" is the prediction, then the
    closest example if that does not converge or leaves outliers."""
    index: str = "auto"
    """Search index: "auto" or a name of `index.selection`."""
    jump_m: Annotated[float, Range(0.0, math.inf)] = field(default=0.1, kw_only=True)

    @property
    def fewest_frames(self) -> int:
        return self.poses + 1

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedDynamicMap":
        """Learn from a database, which may lie on disk."""
        examples = WindowExamples.learn(body, database, self.poses)
        index = make_index(self.index, examples.windows, self.neighbours) if self.search == "history" else None
        return FittedDynamicMap(self, examples, index)


WINDOW = DynamicMap(
    name="dynamic_map:window",
    summary="dynamic_map with examples found by history alone, as in Liu et al. 2011, and regularised",
    search="history",
    poses=2,
    neighbours=100,
    width=1.0,
    ridge=0.1,
    covariance="diagonal",
    spread=8.0,
    widening=0.0,
    ik_prior_weight=0.0,
    least_sigma_rad=math.radians(3.0),
    tilt_sigma_rad=math.radians(5.0),
    height_sigma_m=0.05,
    step_sigma_m=0.3,
    turn_sigma_rad=math.radians(10.0),
    jump_m=JUMP_M,
)
LITERAL = replace(
    WINDOW,
    name="dynamic_map:literal",
    summary="Liu et al. 2011 as printed, eq. 2 to 14, with constants chosen on validation clips",
    neighbours=200,
    width=0.0,
    variance_kept=0.6,
    ridge=0.0,
    spread=1.0,
    least_sigma_rad=math.radians(0.01),
    tilt_sigma_rad=math.radians(0.01),
    height_sigma_m=1e-4,
    start="closest",
    loss=Loss(
        position_sigma_m=0.0007,
        orientation_sigma_rad=math.radians(0.12),
        position_scale_m=0.01,
        orientation_scale_rad=math.radians(3.0),
        quality=False,
        suspect_weight=1.0,
    ),
    jump_m=math.inf,
)
"""The paper as printed. It leaves open K, m, the share of variance, sigma_data, the scale of the Lorentzian, and the
root's place among the examples. scenarios/tune_dynamic_map_literal.toml chose them. The floors of hinges, tilt and
height only avoid a division by 0. The step over the ground and the turn are relative to the last estimate and loose, so
that a slip is not permanent."""


@dataclass(frozen=True, eq=False)
class FittedDynamicMap:
    """The windows of the examples and their search index."""

    options: DynamicMap
    examples: WindowExamples
    index: Index | None
    """Index of the windows; None when `search` is "features"."""
    _regression_cache: CalibrationCache[ReducedRankRegression] = field(default_factory=CalibrationCache)

    def regression(self, calibration: Calibration) -> ReducedRankRegression:
        """The reduced-rank regression for the mounts of a calibration; cached."""
        examples, options = self.examples, self.options.regression
        return self._regression_cache.get(
            calibration, lambda: ReducedRankRegression(examples.body, examples.windows, calibration, options)
        )

    def begin(self, calibration: Calibration) -> "DynamicMapSession":
        self.examples.windows.database.release_memory()  # pages that earlier sessions read
        return DynamicMapSession(self, calibration)


class Prediction(NamedTuple):
    """A Gaussian of the posture (52) and of the step (3) from the last estimate's ground frame."""

    mean: Floats
    """(55,)"""
    covariance: Floats
    """(55, 55)"""
    closest: Floats
    """(55,) what followed the nearest example."""
    ik_prior_weight: float
    """Weight of the prior of `ik`: 0 beside an example, more with the distance."""


class DynamicMapSession(HistorySession):
    """Follows one performer; fits a local model to every frame."""

    def __init__(self, fitted: FittedDynamicMap, calibration: Calibration) -> None:
        options, examples = fitted.options, fitted.examples
        windows = examples.windows
        super().__init__(
            *(examples.body, calibration, options, examples.mean_prior, examples.increments.moments),
            *(options.poses, windows.database.rate_hz),
        )
        self._options, self._windows, self._ik_prior = options, windows, examples.ik_prior
        self._neighbours: NeighbourSearch
        if fitted.index is None:
            regression = fitted.regression(calibration)
            self._neighbours = FeatureSearch(regression, self.residuals, options.index)
        else:
            self._neighbours = PoseHistorySearch(windows, fitted.index)
        sigma = np.zeros(POSTURE_SIZE + 3)
        sigma[HINGES], sigma[TILT], sigma[HEIGHT] = (
            options.least_sigma_rad,
            options.tilt_sigma_rad,
            options.height_sigma_m,
        )
        sigma[POSTURE_SIZE:] = options.step_sigma_m, options.step_sigma_m, options.turn_sigma_rad
        self._least_variance = sigma**2
        self._subspace_solver = (
            SubspaceSolver(self.residuals, self.limits, options.stopping) if options.covariance == "full" else None
        )

    def solve_next(self) -> IKSolution:
        """Eq. 9 and 10: the maximum a posteriori pose of the frame."""
        prediction = self.predict()
        if self._options.start == "closest":
            return self._solve(prediction, prediction.closest)
        return self.solve_from_either(partial(self._solve, prediction), prediction.mean, prediction.closest)

    def solve_cold(self) -> IKSolution:
        """The best pose under the prediction from the readings alone, where they suffice."""
        by_ik = super().solve_cold()
        if self._subspace_solver is None or not self._neighbours.readings_suffice():
            return by_ik
        self.cold_origin = Origin.MODEL
        prediction = self.predict(history=False)
        postures = [
            qpos_from_posture(some[:POSTURE_SIZE], np.zeros(3)) for some in (prediction.mean, prediction.closest)
        ]
        starts = [
            by_ik.qpos,
            *(start for posture in postures for start in candidate_placements(self.residuals, posture)),
        ]
        prior = self.joint_prior(prediction)
        return self.cheapest_in_subspace(self._subspace_solver, prior, starts)

    def solve_without_history(self, frame: TrackerFrame) -> IKSolution:
        """As `solve_cold`, but from the last estimate's place alone."""
        if self._subspace_solver is None or not self._neighbours.readings_suffice():
            return super().solve_without_history(frame)
        return self._solve(self.predict(history=False), np.concatenate([posture_from_qpos(self.qpos), np.zeros(3)]))

    def _solve(self, prediction: Prediction, start: Floats) -> IKSolution:
        """The maximum a posteriori pose that is reached from a posture and step (55,)."""
        if self._subspace_solver is None:
            return self.solver.solve(self._configuration(start), self.independent_prior(prediction))
        ground = ground_after_step(self.past[0], start[POSTURE_SIZE:])
        return self._subspace_solver.solve(self.joint_prior(prediction), ground, start[:POSTURE_SIZE])

    def _configuration(self, following: Floats) -> Floats:
        """Configuration (55,) of a posture (52) after a step (3) from the last estimate's ground frame."""
        out: Floats = qpos_from_posture(
            following[:POSTURE_SIZE], ground_after_step(self.past[0], following[POSTURE_SIZE:])
        )
        return out

    def record(self, frame: TrackerFrame, anew: bool) -> None:
        super().record(frame, anew)
        self._neighbours.record()

    def predict_gap(self) -> Floats:
        prediction = self.predict()
        if self._subspace_solver is None:
            return self.independent_prior(prediction).qpos
        prior, most_likely = self.joint_prior(prediction), prediction.mean.copy()
        most_likely[:POSTURE_SIZE] += np.linalg.solve(prior.curvature, prior.linear)
        return self._configuration(most_likely)

    def predict(self, history: bool = True) -> Prediction:
        """Eq. 8: Gaussian prediction from `past`, widened by factor, floors and distance of the examples.

        Without `history` it comes from the readings alone.
        """
        options, windows = self._options, self._windows
        rows, squared, offsets = self._neighbours.nearest(self.past, options.neighbours, history)
        variance = 1.0 if options.width == 0.0 else options.width * float(squared[len(squared) // 2])
        weight = neighbour_weights(squared, max(variance, _MIN_WEIGHT_VARIANCE))
        after = windows.successors(rows)
        mean, covariance = forecast(offsets, after, weight, options.variance_kept, options.ridge)
        widened = 1.0 + (options.widening * float(squared[0]) / offsets.shape[1]) ** 2
        _widen(mean, covariance, options.spread**2, self._least_variance, widened)
        _clip_hinges(mean, self.limits.low_rad, self.limits.high_rad)
        return Prediction(mean, covariance, after[0].astype(float), options.ik_prior_weight * (1.0 - 1.0 / widened))

    def independent_prior(self, prediction: Prediction) -> Prior:
        """Eq. 8 as printed, without covariances, in world axes and in the solver's tangent space."""
        precision = 1.0 / np.diagonal(prediction.covariance)[_TANGENT_INDICES]
        precision[:2] = precision[:2].min()  # forward and left are not the world's x and y
        prior = Prior(self._configuration(prediction.mean), precision)
        if prediction.ik_prior_weight == 0.0:
            return prior
        return multiply_priors(prior, self.ik_prior(), prediction.ik_prior_weight)

    def ik_prior(self) -> Prior:
        """The prior of `ik` after the last estimate."""
        return self._ik_prior.prior(self.limits, self.past[0])

    def joint_prior(self, prediction: Prediction) -> Subspace:
        """The prediction of the posture with its covariances, times the prior of `ik`; the ground frame is free."""
        ik_prior = self.ik_prior()
        if ik_prior.precision is None:
            raise ValueError("The product of two priors needs the precisions of both.")
        return gaussian_space(
            *(prediction.mean, prediction.covariance, ik_prior.qpos[7:], ik_prior.precision[6:]),
            prediction.ik_prior_weight,
        )


@compiled
def _widen(mean: Floats, covariance: Floats, factor: float, least_variance: Floats, widened: float) -> None:
    """Multiply a covariance (D, D) by a factor, add the floors (D,) to its diagonal, and multiply it by `widened`."""
    for i in range(len(covariance)):
        row = covariance[i]
        for j in range(len(row)):
            row[j] *= factor * widened
        row[i] += least_variance[i] * widened


@compiled
def _clip_hinges(mean: Floats, low_rad: Floats, high_rad: Floats) -> None:
    """Clip the hinges of a posture and step (55,) to their limits (48,)."""
    for i in range(len(low_rad)):
        hinge = HINGES.start + i
        mean[hinge] = min(max(mean[hinge], low_rad[i]), high_rad[i])


_TANGENT_INDICES = np.array(
    [POSTURE_SIZE, POSTURE_SIZE + 1, HEIGHT, 1, 2, POSTURE_SIZE + 2, *range(HINGES.start, HINGES.stop)]
)
"""(54,) index in posture and step of each direction of the solver; tilts are small, so rotations are the root's."""
