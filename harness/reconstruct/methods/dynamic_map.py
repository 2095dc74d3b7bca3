"""Maximum a posteriori poses under a local dynamic model: Liu et al. 2011, eq. 2 to 14 (docs/methods.md A4, A5, E).

At every frame the windows of the database that are most like the present are found, what followed them is regressed
on them, and the pose is solved that is likely both as what follows and by what the trackers read. Like the present are,
in the paper, windows near the last m answers (`dynamic_map:window`; `dynamic_map:literal` is without repairs). Left
to itself such a prediction drifts with its own errors; so by default the readings take part in it, in the search and in
the regression (docs/methods.md G3), in terms of the postures that they lead to expect (`expectation`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

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
from harness.reconstruct.features.reduced_rank_regression import ReducedRankOptions, ReducedRankRegression
from harness.reconstruct.index import Index, make_index
from harness.reconstruct.methods.local_dynamic_model import forecast, neighbour_weights
from harness.reconstruct.methods.mean_pose import mean_posture
from harness.reconstruct.solver.ground_frame import HEIGHT, HINGES, POSTURE_SIZE, TILT, qpos_from_posture
from harness.reconstruct.solver.history_session import HistorySession
from harness.reconstruct.solver.ik_session import POSTURE_PRIOR_SIGMA_RAD, PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution, Prior, Stopping
from harness.reconstruct.solver.outlier_gate import JUMP_M
from harness.reconstruct.solver.residuals import Loss
from harness.reconstruct.solver.status_monitor import LOST_AFTER_S
from harness.stream.frame import TrackerFrame

_MIN_WEIGHT_VARIANCE = 1e-6
"""Smallest variance of the examples' weights; a performer who repeats an example exactly has distances of 0."""


@dataclass(frozen=True)
class DynamicMap:
    """A `Method`; defaults were chosen on validation clips, see scenarios/tune_dynamic_map.toml."""

    name: str = "dynamic_map"
    summary: str = (
        "the pose that is likely by the readings and by a local model of examples, learnt from answers and readings"
    )
    needs_examples: bool = True
    like: Literal["evidence", "window"] = "evidence"
    """What examples must be like: the last answers and the readings, or the last answers alone as in the paper."""
    terms: ReducedRankOptions = field(default_factory=ReducedRankOptions)
    """Of that evidence."""
    poses: int = 3
    """m, answers that the next is predicted from."""
    neighbours: int = 800
    """K, examples of the local model."""
    width: float = 0.2
    """Variance of the weights in squared distances of the K/2-th neighbour; 0 for eq. 6 as printed, D_w = 1."""
    kept: float = 1.0
    """Share of the windows' variance that the regression uses: eq. 5 cuts off the rest, 1 leaves it to the ridge."""
    ridge: float = 1e-3
    """Added to that variance's eigenvalues, as a share of it."""
    spread: float = 8.0
    """Times the examples' standard deviations about the regression: how much worse it may be for another performer.

    Their ratios say which hinges to believe; at 1 the prior is a wall that pulls the body off exact trackers."""
    novelty: float = 0.0
    """Times the root mean square distance of the nearest example per number that neighbours are told apart by, added to
    every sigma."""
    least_sigma_rad: float = math.radians(5.0)
    """Floor of every hinge's standard deviation [rad]."""
    tilt_sigma_rad: float = math.radians(30.0)
    """Of the root's tilt [rad]."""
    height_sigma_m: float = 0.3
    """Of the root's height [m]."""
    step_sigma_m: float = 3.0
    """Of the root's step over the ground from the estimated frame before [m]: loose, or one slip is for ever."""
    turn_sigma_rad: float = math.radians(60.0)
    """Of its turn about the vertical [rad]."""
    start: Literal["prediction", "closest"] = "prediction"
    """Of the solver; the other one, and the closest example is the paper's, takes its place when it costs less."""
    index: str = "auto"
    """How neighbours are searched (`index.choose`)."""
    loss: Loss = field(default_factory=Loss)
    jump_m: float = 0.1
    """A position that jumps farther than this from where the body carries it is left out for a while; inf never [m]."""
    lost_after_s: float = LOST_AFTER_S
    stopping: Stopping = field(default_factory=Stopping)

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedDynamicMap":
        """BadInput without examples that are long enough."""
        if not any(len(take) > self.poses for take in examples):
            found = f"A dynamic map is learnt from examples of more than {self.poses} frames, and there are none."
            raise BadInput(found, "Name some in the scenario.")
        return self.fit_database(body, MotionDatabase.build(body, examples), rng)

    def fit_database(self, body: Body, database: MotionDatabase, rng: np.random.Generator) -> "FittedDynamicMap":
        """From a database that may lie on disk."""
        windows = database.windows(self.poses, with_successor=True)
        index = make_index(self.index, windows, self.neighbours) if self.like == "window" else None
        return FittedDynamicMap(self, body, windows, index, mean_posture(body, database))


WINDOW = DynamicMap(
    "dynamic_map:window",
    "the same with a local model of the last answers alone, as in Liu et al. 2011, its known traps mended",
    like="window",
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
    "Liu et al. 2011 to the letter: 99 % of the variance, weights and sigma as printed, start at the closest",
    like="window",
    poses=2,
    neighbours=40,
    width=0.0,
    kept=0.99,
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
"""The floors only keep a standard deviation of 0 from dividing; sigma of eq. 12 is that of the trackers."""


@dataclass(frozen=True, eq=False)
class FittedDynamicMap:
    """The windows of the examples and an index of them."""

    options: DynamicMap
    body: Body
    windows: Windows
    index: Index | None
    """Of the windows, where they are searched."""
    mean_qpos: Floats
    """(55,) for starts without a past."""
    _evidence: CalibrationCache[ReducedRankRegression] = field(default_factory=CalibrationCache)

    def regression(self, worn: Calibration) -> ReducedRankRegression:
        """Of the database, for stations worn like this; made once."""
        return self._evidence.get(
            worn, lambda: ReducedRankRegression(self.body, self.windows, worn, self.options.terms)
        )

    def begin(self, calibration: Calibration) -> "DynamicMapSession":
        return DynamicMapSession(self, calibration)


class DynamicMapSession(HistorySession):
    """Makes a model for every frame and throws it away."""

    def __init__(self, fitted: FittedDynamicMap, calibration: Calibration) -> None:
        options, windows = fitted.options, fitted.windows
        manner = SolverOptions(options.loss, True, options.jump_m, options.lost_after_s, options.stopping)
        leaning = PosturePrior(fitted.mean_qpos, np.full(48, POSTURE_PRIOR_SIGMA_RAD))
        super().__init__(fitted.body, calibration, manner, leaning, options.poses, windows.database.rate_hz)
        self._options, self._windows = options, windows
        self._precedents: NeighbourSearch
        if fitted.index is None:
            evidence = fitted.regression(calibration)
            self._precedents = FeatureSearch(windows, evidence, self.residuals, options.index)
        else:
            self._precedents = PoseHistorySearch(windows, fitted.index)
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
        """Eq. 9 and 10: the most likely pose of the frame, by the readings and by what went before."""
        prior = self.predict()
        forward = self._options.start == "prediction"
        found = self.solver.solve(prior.qpos if forward else self._configuration(self._closest), prior)
        if found.converged and self.outlier_share() == 0.0:
            return found
        again = self.solver.solve(self._configuration(self._closest) if forward else prior.qpos, prior)
        best = again if again.cost < found.cost else found
        self.residuals.evaluate(best.qpos)
        return best

    def _configuration(self, following: Floats) -> Floats:
        """The configuration (55,) of a posture and of the step to it (55,)."""
        out: Floats = qpos_from_posture(
            following[:POSTURE_SIZE], ground_after_step(self.past[0], following[POSTURE_SIZE:])
        )
        return out

    def record(self, frame: TrackerFrame, anew: bool) -> None:
        super().record(frame, anew)
        self._precedents.record()

    def predict_gap(self) -> Floats:
        return self.predict().qpos

    def predict(self) -> Prior:
        """Eq. 8 for what follows `past`, on the ground and in the solver's tangent space."""
        options, windows = self._options, self._windows
        rows, squared, away = self._precedents.nearest(self.past, options.neighbours)
        variance = 1.0 if options.width == 0.0 else options.width * float(squared[len(squared) // 2])
        weight = neighbour_weights(squared, max(variance, _MIN_WEIGHT_VARIANCE))
        after = windows.successors(rows)
        next_mean, left = forecast(away, after, weight, options.kept, options.ridge)
        self._closest = after[0].astype(float)
        mean = self._configuration(next_mean)
        mean[7:] = self.limits.clip(mean[7:])
        variance_of = options.spread**2 * left + self._least_variance
        variance_of += options.novelty**2 * float(squared[0]) / away.shape[1]
        precision = 1.0 / variance_of[_TANGENT_INDICES]
        precision[:2] = precision[:2].min()  # forward and left are not the world's x and y
        return Prior(mean, precision)


_TANGENT_INDICES = np.array(
    [POSTURE_SIZE, POSTURE_SIZE + 1, HEIGHT, 1, 2, POSTURE_SIZE + 2, *range(HINGES.start, HINGES.stop)]
)
"""(54,) which number of posture and step each direction of the solver is; tilts are small, so turns are the root's."""
