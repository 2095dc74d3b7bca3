"""Local PCA (`local_pca`): the pose within a local linear model of similar examples (docs/papers.md C2).

For every frame:

1. Search the K example windows that are nearest to the last two estimates and to the readings.
2. Fit the mean p and the leading principal directions U of the postures that follow them: q = p + U w.
3. Solve for w and the ground frame by Levenberg-Marquardt: robust residuals of the trackers, plus `prior_weight` times
   the Mahalanobis distance from p, plus `smooth_weight` times the change of velocity.

The ground frame is free, because examples know neither place nor heading. There are no dynamics beyond step 3.

Source: Chai and Hodgins 2005, in the form in which Liu et al. 2011 compare with it. Ours: postures relative to the
ground frame, distances in SI units, the treatment of missing readings, and the outlier gate.

Options are the fields of `LocalPca`; scenarios/tune_local_pca.toml chose the defaults: 300 neighbours, 40 directions,
`prior_weight` 0.3, `smooth_weight` 0.2 with 0.1 rad, `control_weight` 1 m^-2, `lever_m` 0.3 m.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np

from harness.body import Body
from harness.core.arrays import Bools, Floats, Ints, Singles
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.estimate import LOST_AFTER_ADVICE
from harness.core.ranges import Range
from harness.reconstruct.contract import CalibrationCache
from harness.reconstruct.database.frames import Windows
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.virtual_trackers import StationFeatures
from harness.reconstruct.index.exact import nearest_partial
from harness.reconstruct.index.protocol import Index, Vectors
from harness.reconstruct.index.selection import make_index
from harness.reconstruct.methods.window_method import DatabaseLearner, WindowExamples
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE, ground_after_step
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution, Prior, Stopping, multiply_priors
from harness.reconstruct.solver.residuals import Loss
from harness.reconstruct.solver.subspace import SubspaceSolver, fit_subspace

_MIN_WIDENING_RAD = math.radians(1.0)
"""Smallest standard deviation for which the answer is solved again outside the subspace [rad]."""
_NO_STEP: Floats = np.zeros(3)
_HISTORY = 2
"""Number of past estimates in the query (C2)."""


@dataclass(frozen=True)
class LocalPca(DatabaseLearner["FittedLocalPca"], SolverOptions):
    """Options of local PCA, a `Method`; scenarios/tune_local_pca.toml chose the defaults on validation clips."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"lost_after_s": LOST_AFTER_ADVICE}

    name: str = "local_pca"
    summary: str = "best fit to the readings within the principal directions of similar examples"
    fewest_frames = _HISTORY + 1
    neighbours: Annotated[int, Range(2, 1_000_000)] = 300
    """K, examples of the local model."""
    components: Annotated[int, Range(1, 55)] = 40
    """Number of principal directions."""
    prior_weight: Annotated[float, Range(0.0, 1e6)] = 0.3
    """alpha: weight of the squared distance from the mean, in the examples' standard deviations."""
    smooth_weight: Annotated[float, Range(0.0, 1e6)] = 0.2
    """beta: weight of the squared change of velocity, in units of `smooth_sigma_rad`."""
    smooth_sigma_rad: Annotated[float, Range(1e-06, 100.0)] = 0.1
    """Typical change of a hinge's step from one frame to the next [rad; m for the height]."""
    control_weight: Annotated[float, Range(0.0, 1e6)] = 1.0
    """Weight of the readings in the query: m^2 of the readings against rad^2 of the postures."""
    lever_m: Annotated[float, Range(1e-06, 100.0)] = 0.3
    """Displacement that counts as much as a rotation of one radian in the query [m]."""
    index: str = "auto"
    """Search index: "auto" or a name of `index.selection`."""
    widening: Annotated[float, Range(0.0, 1e6)] = 20.0
    """Standard deviation of each hinge about the answer within the subspace [rad]: this times the squared RMS distance
    of the nearest example, per column of the query. Below 1 deg the answer stays within the subspace."""
    ik_prior_weight: Annotated[float, Range(0.0, 1e6)] = 9.0
    """Weight of the prior of `ik` where the answer leaves the subspace; 0 leaves it out."""
    restart: bool = True
    """Whether a cold start follows when readings contradict the answer for long; if not, only after a loss."""
    stopping: Stopping = field(default_factory=lambda: Stopping(decrease=1e-2), kw_only=True)
    """Convergence criteria. They are looser than those of `ik`; on validation clips errors differ by 0.001 deg."""

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedLocalPca":
        """Learn from a database, which may lie on disk."""
        return FittedLocalPca(self, WindowExamples.learn(body, database, _HISTORY))


CHAI2005 = LocalPca(
    name="local_pca:chai2005",
    summary=(
        "Chai and Hodgins 2005: 7 principal directions, squared residuals; its other constants are recalled or chosen"
    ),
    neighbours=100,
    components=7,
    prior_weight=0.8,
    smooth_weight=0.2,
    smooth_sigma_rad=1.0,
    widening=0.0,
    ik_prior_weight=0.0,
    restart=False,
    loss=Loss(robust=False, quality=False, suspect_weight=1.0),
    jump_m=math.inf,
)
"""Recalled from the paper, which could not be opened (docs/papers.md C2): 7 directions, alpha 0.8, beta 0.2, the solve
from the closest example. Chosen on validation clips: the number of neighbours and the units of the three terms."""


@dataclass(frozen=True, eq=False)
class FittedLocalPca:
    """The windows of the examples. Their station features depend on the mounts and are cached per calibration."""

    options: LocalPca
    examples: WindowExamples
    cache: "CalibrationCache[tuple[StationFeatures, Vectors, Index]]" = field(
        default_factory=CalibrationCache, repr=False
    )
    """Station features and search index of the last calibration, shared by sessions of one performer."""

    def begin(self, calibration: Calibration) -> "LocalPcaSession":
        self.examples.windows.database.release_memory()  # pages that earlier sessions read
        return LocalPcaSession(self, calibration)

    def station_features(self, calibration: Calibration) -> "tuple[StationFeatures, Vectors, Index]":
        """Station features after every window for these mounts, the search vectors, and their index; cached."""
        return self.cache.get(calibration, lambda: self._compute_station_features(calibration))

    def _compute_station_features(self, calibration: Calibration) -> "tuple[StationFeatures, Vectors, Index]":
        options, windows = self.options, self.examples.windows
        features = StationFeatures(self.examples.body, windows, calibration, options.lever_m)
        vectors = _WindowsWithFeatures(windows, features.values, np.sqrt(options.control_weight))
        return features, vectors, make_index(options.index, vectors, options.neighbours)


class LocalPcaSession(HistorySession):
    """Follows one performer; fits a local model to every frame."""

    def __init__(self, fitted: FittedLocalPca, calibration: Calibration) -> None:
        options, examples = fitted.options, fitted.examples
        super().__init__(
            *(examples.body, calibration, options, examples.mean_prior, examples.increments.moments),
            *(_HISTORY, examples.windows.database.rate_hz),
        )
        self._options, self._windows, self._ik_prior = options, examples.windows, examples.ik_prior
        self._subspace_solver = SubspaceSolver(self.residuals, self.limits, options.stopping)
        self._precision = np.zeros(6 + len(self.limits.low_rad))
        self._features, self._examples, index = fitted.station_features(calibration)
        self._index = index.begin_search()

    def solve_next(self) -> IKSolution:
        options = self._options
        history = self._windows.query(self.past)
        rows, squared = self._nearest(history)
        poses = self._windows.successors(rows)
        postures, closest = poses[:, :POSTURE_SIZE], poses[0].astype(float)
        beta = options.smooth_weight / options.smooth_sigma_rad**2
        space = fit_subspace(postures, options.components, options.prior_weight, _constant_velocity(history), beta)
        solution = self._subspace_solver.solve(
            space, ground_after_step(self.past[0], closest[POSTURE_SIZE:]), closest[:POSTURE_SIZE]
        )
        sigma_rad = options.widening * squared / self._examples.size
        if sigma_rad < _MIN_WIDENING_RAD:
            return solution
        self._precision[6:] = sigma_rad**-2
        prior = Prior(solution.qpos, self._precision)
        ik_prior = self._ik_prior.prior(self.limits, self.past[0])
        return self.solver.solve(solution.qpos, multiply_priors(prior, ik_prior, options.ik_prior_weight))

    def predict_gap(self) -> Floats:
        """The last estimate, since the model has no dynamics."""
        last: Floats = self.past[0]
        return last

    def _nearest(self, past: Singles) -> tuple[Ints, float]:
        """Rows (K,) of the nearest examples by readings and history, and the squared distance of the first.

        Missing readings count nothing.
        """
        residuals, features, options = self.residuals, self._features, self._options
        scale = np.float32(np.sqrt(options.control_weight))
        position_m, turned = residuals.target_m, residuals.world_from_target
        ground = ground_after_step(self.past[0], _NO_STEP)
        if residuals.measured.all():
            query = _join(past, scale, features.query(position_m, turned, ground))
            rows, squared = self._index.nearest(query, options.neighbours)
            return rows, float(squared[0])
        control = features.query(*residuals.completed(self.past[0]), ground)
        weight = np.concatenate([np.ones(len(past)), features.columns(residuals.measured)])
        query = np.concatenate([past, scale * control])
        rows, squared = nearest_partial(self._index, self._examples, query, weight, options.neighbours)
        return rows, float(squared[0])


@compiled
def _constant_velocity(window: Singles) -> Floats:
    """(52,) the posture that follows the last two of a window at constant velocity."""
    out, before = np.empty(POSTURE_SIZE), len(window) - POSTURE_SIZE
    for i in range(POSTURE_SIZE):
        out[i] = 2.0 * window[i] - window[before + i]
    return out


@compiled
def _join(window: Singles, scale: np.float32, features: Singles) -> Singles:
    """A window (D,) and features (C,) times a scale."""
    out = np.empty(len(window) + len(features), np.float32)
    out[: len(window)] = window
    for i in range(len(features)):
        out[len(window) + i] = scale * features[i]
    return out


@dataclass(frozen=True, eq=False)
class _WindowsWithFeatures:
    """Search `Vectors`: two postures, and the station features of the frame after them."""

    windows: Windows
    features: Singles
    scale: float

    def __len__(self) -> int:
        return len(self.windows)

    @property
    def size(self) -> int:
        return self.windows.size + int(self.features.shape[1])

    @property
    def consecutive(self) -> Bools:
        return self.windows.consecutive

    def gather(self, rows: Ints | slice) -> Singles:
        return np.concatenate([self.windows.gather(rows), np.float32(self.scale) * self.features[rows]], axis=1)
