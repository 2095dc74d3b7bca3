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

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats, Ints, Singles
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.database import MotionDatabase, Windows
from harness.reconstruct.features.calibration_cache import CalibrationCache
from harness.reconstruct.features.ground_step import ground_after_step
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.features.station_features import StationFeatures
from harness.reconstruct.index import Index, Vectors, make_index, nearest_partial
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import POSTURE_PRIOR_SIGMA_RAD, PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution, Stopping
from harness.reconstruct.solver.outlier_gate import JUMP_M
from harness.reconstruct.solver.residuals import Loss
from harness.reconstruct.solver.status_monitor import LOST_AFTER_S
from harness.reconstruct.solver.subspace import SubspaceSolver, fit_subspace

_HISTORY = 2
"""Number of past estimates in the query (C2)."""


@dataclass(frozen=True)
class LocalPca:
    """Options of local PCA, a `Method`; scenarios/tune_local_pca.toml chose the defaults on validation clips."""

    name: str = "local_pca"
    summary: str = "best fit to the readings within the principal directions of similar examples"
    needs_examples: bool = True
    neighbours: int = 300
    """K, examples of the local model."""
    components: int = 40
    """Number of principal directions."""
    prior_weight: float = 0.3
    """alpha: weight of the squared distance from the mean, in the examples' standard deviations."""
    smooth_weight: float = 0.2
    """beta: weight of the squared change of velocity, in units of `smooth_sigma_rad`."""
    smooth_sigma_rad: float = 0.1
    """Typical change of a hinge's step from one frame to the next [rad; m for the height]."""
    control_weight: float = 1.0
    """Weight of the readings in the query: m^2 of the readings against rad^2 of the postures."""
    lever_m: float = 0.3
    """Displacement that counts as much as a rotation of one radian in the query [m]."""
    index: str = "auto"
    """Search index: "auto" or a name of `index.selection`."""
    loss: Loss = field(default_factory=Loss)
    """Scales and robust loss of the residuals."""
    jump_m: float = JUMP_M
    """Outlier gate: a position this far from its prediction is left out for a while [m]; inf disables the gate."""
    lost_after_s: float = LOST_AFTER_S
    """Time without readings after which the status is LOST [s]."""
    stopping: Stopping = field(default_factory=lambda: Stopping(decrease=1e-2))
    """Convergence criteria. They are looser than those of `ik`; on validation clips errors differ by 0.001 deg."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedLocalPca":
        """Build the database; BadInput without examples of three frames or more."""
        if not any(len(take) > _HISTORY for take in examples):
            message = f"Local PCA needs examples of more than {_HISTORY} frames, and there are none."
            raise BadInput(message, "Name some in the scenario.")
        return self.fit_database(body, MotionDatabase.build(body, examples), rng)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedLocalPca":
        """Learn from a database, which may lie on disk."""
        return FittedLocalPca(self, body, database.windows(_HISTORY, with_successor=True), mean_posture(body, database))


@dataclass(frozen=True, eq=False)
class FittedLocalPca:
    """The windows of the examples. Their station features depend on the mounts and are cached per calibration."""

    options: LocalPca
    body: Body
    windows: Windows
    mean_qpos: Floats
    """(55,) mean posture, the prior of frames without a history."""
    cache: "CalibrationCache[tuple[StationFeatures, Vectors, Index]]" = field(
        default_factory=CalibrationCache, repr=False
    )
    """Station features and search index of the last calibration, shared by sessions of one performer."""

    def begin(self, calibration: Calibration) -> "LocalPcaSession":
        return LocalPcaSession(self, calibration)

    def station_features(self, calibration: Calibration) -> "tuple[StationFeatures, Vectors, Index]":
        """Station features after every window for these mounts, the search vectors, and their index; cached."""
        return self.cache.get(calibration, lambda: self._compute_station_features(calibration))

    def _compute_station_features(self, calibration: Calibration) -> "tuple[StationFeatures, Vectors, Index]":
        features = StationFeatures(self.body, self.windows, calibration, self.options.lever_m)
        examples = _WindowsWithFeatures(self.windows, features.values, np.sqrt(self.options.control_weight))
        return features, examples, make_index(self.options.index, examples, self.options.neighbours)


class LocalPcaSession(HistorySession):
    """Follows one performer; fits a local model to every frame."""

    def __init__(self, fitted: FittedLocalPca, calibration: Calibration) -> None:
        options, windows = fitted.options, fitted.windows
        solver_options = SolverOptions(options.loss, True, options.jump_m, options.lost_after_s, options.stopping)
        posture_prior = PosturePrior(fitted.mean_qpos, np.full(48, POSTURE_PRIOR_SIGMA_RAD))
        super().__init__(fitted.body, calibration, solver_options, posture_prior, _HISTORY, windows.database.rate_hz)
        self._options, self._windows = options, windows
        self._subspace_solver = SubspaceSolver(self.residuals, self.limits, options.stopping)
        self._features, self._examples, self._index = fitted.station_features(calibration)

    def solve_next(self) -> IKSolution:
        options = self._options
        history = self._windows.query(self.past)
        rows = self._nearest(history)
        poses = self._windows.successors(rows)
        postures, closest = poses[:, :POSTURE_SIZE], poses[0].astype(float)
        constant_velocity = 2.0 * history[:POSTURE_SIZE].astype(float) - history[-POSTURE_SIZE:]
        beta = options.smooth_weight / options.smooth_sigma_rad**2
        space = fit_subspace(postures, options.components, options.prior_weight, constant_velocity, beta)
        return self._subspace_solver.solve(
            space, ground_after_step(self.past[0], closest[POSTURE_SIZE:]), closest[:POSTURE_SIZE]
        )

    def predict_gap(self) -> Floats:
        """The last estimate, since the model has no dynamics."""
        last: Floats = self.past[0]
        return last

    def _nearest(self, past: Singles) -> Ints:
        """Rows (K,) of the nearest examples by readings and history; missing readings count nothing."""
        residuals, features, options = self.residuals, self._features, self._options
        scale = np.float32(np.sqrt(options.control_weight))
        position_m, turned = residuals.target_m, residuals.world_from_target
        ground = ground_after_step(self.past[0], np.zeros(3))
        if residuals.measured.all():
            query = np.concatenate([past, scale * features.query(position_m, turned, ground)])
            rows, _ = self._index.nearest(query, options.neighbours)
            return rows
        count = len(position_m)
        has_position, has_orientation = residuals.measured[:count, None], residuals.measured[count:, None]
        at_m, at_orientation = features.station_poses(residuals.kinematics, self.past[0])
        control = features.query(
            np.where(has_position, position_m, at_m), np.where(has_orientation, turned, at_orientation), ground
        )
        weight = np.concatenate([np.ones(len(past)), features.columns(residuals.measured)])
        query = np.concatenate([past, scale * control])
        rows, _ = nearest_partial(self._index, self._examples, query, weight, options.neighbours)
        return rows


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

    def gather(self, rows: Ints | slice) -> Singles:
        return np.concatenate([self.windows.gather(rows), np.float32(self.scale) * self.features[rows]], axis=1)
