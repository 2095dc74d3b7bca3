"""Local dynamic model (`dynamic_map`): maximum a posteriori poses (docs/papers.md A4, A5, E).

For every frame:

1. Search the K example windows that are most like the present.
2. Regress the posture and step that follow them on the windows (`local_dynamic_model`): a Gaussian prediction.
3. Solve for the pose that maximises prediction times likelihood of the readings, by Levenberg-Marquardt.

Source: Liu et al. 2011, eq. 2 to 14. Three variants:

- `dynamic_map:literal`: a first literal reading of the paper; it answers mostly by its IK fallback. Windows are
  compared by the last m estimates.
- `dynamic_map:window`: the same search, with a ridge in place of cut-off components, wider weights and sigmas.
- `dynamic_map` (ours): readings take part in the search and in the regression, by features from a reduced-rank
  regression (`reduced_rank_regression`). A prediction from its own estimates alone drifts with its errors.

Options are the fields of `DynamicMap`; scenarios/tune_dynamic_map.toml chose the defaults: `search` "features", 3
poses, 800 neighbours, `width` 0.2, `ridge` 1e-3, `spread` 8, and floors of the prediction's standard deviations: 5 deg
(hinges), 30 deg (tilt), 0.3 m (height), 3 m and 60 deg (step). `regression` holds the options of the features.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.database import MotionDatabase, Windows
from harness.reconstruct.features.calibration_cache import CalibrationCache
from harness.reconstruct.features.ground_step import ground_after_step
from harness.reconstruct.features.neighbour_search import FeatureSearch, NeighbourSearch, PoseHistorySearch
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.features.reduced_rank_regression import ReducedRankOptions, ReducedRankRegression
from harness.reconstruct.index import Index, make_index
from harness.reconstruct.methods.local_dynamic_model import forecast, neighbour_weights
from harness.reconstruct.solver.ground_frame import HEIGHT, HINGES, POSTURE_SIZE, TILT, qpos_from_posture
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import POSTURE_PRIOR_SIGMA_RAD, PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution, Prior, Stopping
from harness.reconstruct.solver.outlier_gate import JUMP_M
from harness.reconstruct.solver.residuals import Loss
from harness.reconstruct.solver.status_monitor import LOST_AFTER_S
from harness.stream.frame import TrackerFrame

_MIN_WEIGHT_VARIANCE = 1e-6
"""Smallest variance of the neighbours' weights, for a performer who repeats an example exactly."""


@dataclass(frozen=True)
class DynamicMap:
    """Options of the local dynamic model, a `Method`; scenarios/tune_dynamic_map.toml chose the defaults."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"terms": "regression", "like": "search", "kept": "variance_kept"}

    name: str = "dynamic_map"
    summary: str = "maximum a posteriori pose under a local dynamic model of examples, found by history and readings"
    needs_examples: bool = True
    search: Literal["features", "history"] = "features"
    """Search of the neighbours: by the last estimates and the readings, or by the last estimates alone (the paper)."""
    regression: ReducedRankOptions = field(default_factory=ReducedRankOptions)
    """Options of the reduced-rank regression that makes the features; used when `search` is "features"."""
    poses: int = 3
    """m: number of past estimates from which the next pose is predicted."""
    neighbours: int = 800
    """K: number of examples in the local model."""
    width: float = 0.2
    """Variance of the weights over the K/2-th neighbour's squared distance; 0 is eq. 6 as printed, D_w = 1."""
    variance_kept: float = 1.0
    """Share of the windows' variance that the regression uses (eq. 5); 1 keeps all and relies on the ridge."""
    ridge: float = 1e-3
    """Ridge added to the eigenvalues of the windows' covariance, as a share of its trace."""
    spread: float = 8.0
    """Factor on the standard deviations of the prediction, which allows for another performer than the examples'.

    At 1 the prior is so narrow that it pulls the body off exact trackers."""
    novelty: float = 0.0
    """Factor on the nearest example's RMS distance per column, which is added to every sigma in quadrature."""
    least_sigma_rad: float = math.radians(5.0)
    """Floor of every hinge's standard deviation [rad]."""
    tilt_sigma_rad: float = math.radians(30.0)
    """Floor of the root's tilt, standard deviation [rad]."""
    height_sigma_m: float = 0.3
    """Floor of the root's height, standard deviation [m]."""
    step_sigma_m: float = 3.0
    """Floor of the root's step over the ground, standard deviation [m]; a small one makes a slip permanent."""
    turn_sigma_rad: float = math.radians(60.0)
    """Floor of the root's rotation about the vertical per frame, standard deviation [rad]."""
    start: Literal["prediction", "closest"] = "prediction"
    """Start of the solver; the paper's is "closest". The other start is tried if the first fails or leaves outliers."""
    index: str = "auto"
    """Search index: "auto" or a name of `index.selection`."""
    loss: Loss = field(default_factory=Loss)
    """Scales and robust loss of the residuals."""
    jump_m: float = 0.1
    """Outlier gate: a position this far from its prediction is left out for a while [m]; inf disables the gate."""
    lost_after_s: float = LOST_AFTER_S
    """Time without readings after which the status is LOST [s]."""
    stopping: Stopping = field(default_factory=Stopping)
    """Convergence criteria of the solver."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedDynamicMap":
        """Build the database; BadInput without examples of more than `poses` frames."""
        if not any(len(take) > self.poses for take in examples):
            message = f"A dynamic map needs examples of more than {self.poses} frames, and there are none."
            raise BadInput(message, "Name some in the scenario.")
        return self.fit_database(body, MotionDatabase.build(body, examples), rng)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedDynamicMap":
        """Learn from a database, which may lie on disk."""
        windows = database.windows(self.poses, with_successor=True)
        index = make_index(self.index, windows, self.neighbours) if self.search == "history" else None
        return FittedDynamicMap(self, body, windows, index, mean_posture(body, database))


WINDOW = DynamicMap(
    "dynamic_map:window",
    "dynamic_map with examples found by history alone, as in Liu et al. 2011, and regularised",
    search="history",
    poses=2,
    neighbours=100,
    width=1.0,
    ridge=0.1,
    least_sigma_rad=math.radians(3.0),
    tilt_sigma_rad=math.radians(5.0),
    height_sigma_m=0.05,
    step_sigma_m=0.3,
    turn_sigma_rad=math.radians(10.0),
    jump_m=JUMP_M,
)
LITERAL = DynamicMap(
    "dynamic_map:literal",
    "a first literal reading of Liu et al. 2011: 99 % of the variance, no ridge, start at the nearest example",
    search="history",
    poses=2,
    neighbours=40,
    width=0.0,
    variance_kept=0.99,
    ridge=0.0,
    spread=1.0,
    least_sigma_rad=math.radians(0.01),
    tilt_sigma_rad=math.radians(0.01),
    height_sigma_m=1e-4,
    step_sigma_m=1e-4,
    turn_sigma_rad=math.radians(0.01),
    start="closest",
    loss=Loss(position_scale_m=0.003, orientation_scale_rad=math.radians(0.5), quality=False, suspect_weight=1.0),
    jump_m=math.inf,
)
"""The paper as printed. The floors only avoid a division by 0; sigma of eq. 12 is that of the trackers."""


@dataclass(frozen=True, eq=False)
class FittedDynamicMap:
    """The windows of the examples and their search index."""

    options: DynamicMap
    body: Body
    windows: Windows
    index: Index | None
    """Index of the windows; None when `search` is "features"."""
    mean_qpos: Floats
    """(55,) mean posture, the prior of frames without a history."""
    _regression_cache: CalibrationCache[ReducedRankRegression] = field(default_factory=CalibrationCache)

    def regression(self, calibration: Calibration) -> ReducedRankRegression:
        """The reduced-rank regression for the mounts of a calibration; cached."""
        return self._regression_cache.get(
            calibration, lambda: ReducedRankRegression(self.body, self.windows, calibration, self.options.regression)
        )

    def begin(self, calibration: Calibration) -> "DynamicMapSession":
        return DynamicMapSession(self, calibration)


class DynamicMapSession(HistorySession):
    """Follows one performer; fits a local model to every frame."""

    def __init__(self, fitted: FittedDynamicMap, calibration: Calibration) -> None:
        options, windows = fitted.options, fitted.windows
        solver_options = SolverOptions(options.loss, True, options.jump_m, options.lost_after_s, options.stopping)
        posture_prior = PosturePrior(fitted.mean_qpos, np.full(48, POSTURE_PRIOR_SIGMA_RAD))
        super().__init__(
            fitted.body, calibration, solver_options, posture_prior, options.poses, windows.database.rate_hz
        )
        self._options, self._windows = options, windows
        self._neighbours: NeighbourSearch
        if fitted.index is None:
            regression = fitted.regression(calibration)
            self._neighbours = FeatureSearch(windows, regression, self.residuals, options.index)
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
        self._closest: Floats = np.zeros(POSTURE_SIZE + 3)

    def solve_next(self) -> IKSolution:
        """Eq. 9 and 10: the maximum a posteriori pose of the frame."""
        prior = self.predict()
        from_prediction = self._options.start == "prediction"
        solution = self.solver.solve(prior.qpos if from_prediction else self._configuration(self._closest), prior)
        if solution.converged and self.outlier_share() == 0.0:
            return solution
        second = self.solver.solve(self._configuration(self._closest) if from_prediction else prior.qpos, prior)
        best = second if second.cost < solution.cost else solution
        self.residuals.evaluate(best.qpos)
        return best

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
        return self.predict().qpos

    def predict(self) -> Prior:
        """Eq. 8: Gaussian prediction from `past`, in world axes and in the solver's tangent space."""
        options, windows = self._options, self._windows
        rows, squared, offsets = self._neighbours.nearest(self.past, options.neighbours)
        variance = 1.0 if options.width == 0.0 else options.width * float(squared[len(squared) // 2])
        weight = neighbour_weights(squared, max(variance, _MIN_WEIGHT_VARIANCE))
        after = windows.successors(rows)
        next_mean, left = forecast(offsets, after, weight, options.variance_kept, options.ridge)
        self._closest = after[0].astype(float)
        mean = self._configuration(next_mean)
        mean[7:] = self.limits.clip(mean[7:])
        variance_of = options.spread**2 * left + self._least_variance
        variance_of += options.novelty**2 * float(squared[0]) / offsets.shape[1]
        precision = 1.0 / variance_of[_TANGENT_INDICES]
        precision[:2] = precision[:2].min()  # forward and left are not the world's x and y
        return Prior(mean, precision)


_TANGENT_INDICES = np.array(
    [POSTURE_SIZE, POSTURE_SIZE + 1, HEIGHT, 1, 2, POSTURE_SIZE + 2, *range(HINGES.start, HINGES.stop)]
)
"""(54,) index in posture and step of each direction of the solver; tilts are small, so rotations are the root's."""
