"""Poses within a local linear model: Chai and Hodgins 2005, the baseline of Liu et al. 2011 (docs/methods.md C2).

At every frame the examples are found that read like the trackers and follow poses like the last two answers. Their
mean and a few principal directions span the poses that are possible: q = p + U w. The ground frame is free, for the
examples know neither place nor heading. No dynamics beyond a pull to constant velocity.
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
from harness.reconstruct.features.station_features import StationFeatures
from harness.reconstruct.index import Index, Vectors, make_index, nearest_partial
from harness.reconstruct.methods.mean_pose import mean_posture
from harness.reconstruct.solver.ground_frame import POSTURE_SIZE
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import POSTURE_PRIOR_SIGMA_RAD, PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution, Stopping
from harness.reconstruct.solver.outlier_gate import JUMP_M
from harness.reconstruct.solver.residuals import Loss
from harness.reconstruct.solver.status_monitor import LOST_AFTER_S
from harness.reconstruct.solver.subspace import SubspaceSolver, fit_subspace

_HISTORY = 2
"""Poses of the query, C2."""


@dataclass(frozen=True)
class LocalPca:
    """A `Method`; defaults were chosen on validation clips, see scenarios/tune_local_pca.toml."""

    name: str = "local_pca"
    summary: str = "the pose within a few principal directions of similar examples that fits the readings best"
    needs_examples: bool = True
    neighbours: int = 300
    """K, examples of the local model."""
    components: int = 40
    """Directions in which a pose may leave their mean."""
    prior_weight: float = 0.3
    """alpha, of the distance from the mean in the examples' own standard deviations."""
    smooth_weight: float = 0.2
    """beta, of a change of velocity, in units of `smooth_sigma_rad`."""
    smooth_sigma_rad: float = 0.1
    """What a hinge's velocity changes by from frame to frame [rad; m for the height]."""
    control_weight: float = 1.0
    """Of the readings in the query, squared distances in m^2 against rad^2 of the poses."""
    lever_m: float = 0.3
    """In the query, an orientation that is off by an angle counts like a position off by the angle times this [m]."""
    index: str = "auto"
    """How neighbours are searched (`index.choose`)."""
    loss: Loss = field(default_factory=Loss)
    jump_m: float = JUMP_M
    """A position that jumps farther than this from where the body carries it is left out for a while; inf never [m]."""
    lost_after_s: float = LOST_AFTER_S
    stopping: Stopping = field(default_factory=lambda: Stopping(decrease=1e-2))
    """Sooner than for a pose without a model: on validation clips errors stay the same to 0.001 deg."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedLocalPca":
        """BadInput without examples that are long enough."""
        if not any(len(take) > _HISTORY for take in examples):
            found = f"Local PCA is learnt from examples of more than {_HISTORY} frames, and there are none."
            raise BadInput(found, "Name some in the scenario.")
        return self.fit_database(body, MotionDatabase.build(body, examples), rng)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedLocalPca":
        """From a database that may lie on disk."""
        return FittedLocalPca(self, body, database.windows(_HISTORY, with_successor=True), mean_posture(body, database))


@dataclass(frozen=True, eq=False)
class FittedLocalPca:
    """The examples; what trackers would have read in them depends on where they are worn."""

    options: LocalPca
    body: Body
    windows: Windows
    mean_qpos: Floats
    """(55,) for starts without a past."""

    cache: "CalibrationCache[tuple[StationFeatures, Vectors, Index]]" = field(
        default_factory=CalibrationCache, repr=False
    )
    """What the last calibration has the trackers read, and the search in it: sessions of one performer share it."""

    def begin(self, calibration: Calibration) -> "LocalPcaSession":
        return LocalPcaSession(self, calibration)

    def station_features(self, calibration: Calibration) -> "tuple[StationFeatures, Vectors, Index]":
        """What trackers worn so would have read after every window; both together, and an index of them."""
        return self.cache.get(calibration, lambda: self._seen_through(calibration))

    def _seen_through(self, calibration: Calibration) -> "tuple[StationFeatures, Vectors, Index]":
        controls = StationFeatures(self.body, self.windows, calibration, self.options.lever_m)
        examples = _WindowsWithFeatures(self.windows, controls.values, np.sqrt(self.options.control_weight))
        return controls, examples, make_index(self.options.index, examples, self.options.neighbours)


class LocalPcaSession(HistorySession):
    """Makes a model for every frame and throws it away."""

    def __init__(self, fitted: FittedLocalPca, calibration: Calibration) -> None:
        options, windows = fitted.options, fitted.windows
        manner = SolverOptions(options.loss, True, options.jump_m, options.lost_after_s, options.stopping)
        leaning = PosturePrior(fitted.mean_qpos, np.full(48, POSTURE_PRIOR_SIGMA_RAD))
        super().__init__(fitted.body, calibration, manner, leaning, _HISTORY, windows.database.rate_hz)
        self._options, self._windows = options, windows
        self._confined = SubspaceSolver(self.residuals, self.limits, options.stopping)
        self._controls, self._examples, self._index = fitted.station_features(calibration)

    def solve_next(self) -> IKSolution:
        options = self._options
        before = self._windows.query(self.past)
        rows = self._nearest(before)
        poses = self._windows.successors(rows)
        postures, closest = poses[:, :POSTURE_SIZE], poses[0].astype(float)
        steady = 2.0 * before[:POSTURE_SIZE].astype(float) - before[-POSTURE_SIZE:]
        beta = options.smooth_weight / options.smooth_sigma_rad**2
        space = fit_subspace(postures, options.components, options.prior_weight, steady, beta)
        return self._confined.solve(
            space, ground_after_step(self.past[0], closest[POSTURE_SIZE:]), closest[:POSTURE_SIZE]
        )

    def predict_gap(self) -> Floats:
        """Nothing was read, and there are no dynamics: as it was."""
        held: Floats = self.past[0]
        return held

    def _nearest(self, past: Singles) -> Ints:
        """Rows (K,) of the examples nearest to the readings and the past; what was not read follows the past."""
        residuals, controls, options = self.residuals, self._controls, self._options
        scale = np.float32(np.sqrt(options.control_weight))
        position_m, turned = residuals.target_m, residuals.world_from_target
        ground = ground_after_step(self.past[0], np.zeros(3))
        if residuals.measured.all():
            query = np.concatenate([past, scale * controls.query(position_m, turned, ground)])
            rows, _ = self._index.nearest(query, options.neighbours)
            return rows
        count = len(position_m)
        here, facing = residuals.measured[:count, None], residuals.measured[count:, None]
        at_m, at_turned = controls.station_poses(residuals.kinematics, self.past[0])
        control = controls.query(np.where(here, position_m, at_m), np.where(facing, turned, at_turned), ground)
        weight = np.concatenate([np.ones(len(past)), controls.columns(residuals.measured)])
        query = np.concatenate([past, scale * control])
        rows, _ = nearest_partial(self._index, self._examples, query, weight, options.neighbours)
        return rows


@dataclass(frozen=True, eq=False)
class _WindowsWithFeatures:
    """`Vectors`: two poses, and what trackers would have read in the frame after them."""

    windows: Windows
    controls: Singles
    scale: float

    def __len__(self) -> int:
        return len(self.windows)

    @property
    def size(self) -> int:
        return self.windows.size + int(self.controls.shape[1])

    def gather(self, rows: Ints | slice) -> Singles:
        return np.concatenate([self.windows.gather(rows), np.float32(self.scale) * self.controls[rows]], axis=1)
