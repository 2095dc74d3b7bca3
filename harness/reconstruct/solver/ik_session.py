"""Following one performer through a take: what every session that solves for poses has in common.

Frame by frame the pose is solved from the one before. It is sought anew, from the T-pose and its kin and without
trust in the past, at the start, after a loss, when most readings jump at once, and when the readings go on
contradicting the pose; the cheaper of the two wins.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.reconstruct.features.device_time import DeviceTime
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolution, IKSolver, Prior, Stopping
from harness.reconstruct.solver.outlier_gate import JUMP_M, PATIENCE_S, OutlierGate
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import candidate_placements, starting_postures
from harness.reconstruct.solver.status_monitor import LOST_AFTER_S, StatusMonitor
from harness.stream.frame import TrackerFrame

POSTURE_PRIOR_SIGMA_RAD = float(np.deg2rad(30.0))
"""Of hinges about the examples' mean posture, while there is no past to go by [rad]."""
_OUTLIER_SCALES = 2.0
"""A reading contradicts the pose when it is off by more than so many times the Lorentzian's scale: 6 cm, 16 deg."""
_OUTLIER_SHARE = 0.25
"""When this share of the readings does so, the pose is sought anew at once; else once it has lasted `PATIENCE_S`."""
_LOSS_SCALE_FACTORS = (10.0, 3.0, 1.0)
_PROBE_STEPS, _PROBE_COST_RATIO = 6, 3.0
"""A start is looked at for so many steps, and left when it is so many times as dear as the best one by then: most
have all but arrived, and those that stand upside down never do."""
_DUPLICATE_TOLERANCE = 1e-3
"""Configurations that differ nowhere by more are one [m, rad]."""
"""How much farther the Lorentzian reaches while a cold start closes in."""


@dataclass(frozen=True, eq=False)
class PosturePrior:
    """The weak prior that fills in what trackers leave open when nothing better is known. The root has none."""

    mean_qpos: Floats | None
    """(55,) mean posture of examples; None when there is nothing to learn it from."""
    spread_rad: Floats
    """(48,) standard deviation of each hinge; inf for no prior."""
    towards_mean: float = 1.0
    """Where the prior's mean lies between the previous pose, 0, and the mean posture, 1."""

    def prior(self, limits: HingeLimits, previous: Floats) -> Prior:
        """Seen from a pose (55,)."""
        mean, precision = previous, np.zeros(6 + len(self.spread_rad))
        precision[6:] = self.spread_rad**-2.0
        if self.mean_qpos is not None:
            mean = np.array(previous)
            posture = limits.unwrap_near(self.mean_qpos[7:], previous[7:])
            mean[7:] += self.towards_mean * (posture - previous[7:])
        return Prior(mean, precision)


@dataclass(frozen=True)
class SolverOptions:
    """How a performer is followed."""

    loss: Loss = field(default_factory=Loss)
    limits: bool = True
    """Keep hinges within the body's limits."""
    jump_m: float = JUMP_M
    """A position that jumps farther than this from where the body carries it is left out for a while; inf never [m]."""
    lost_after_s: float = LOST_AFTER_S
    stopping: Stopping = field(default_factory=Stopping)


class IKSession:
    """A `Session`. What differs from method to method is `followed`, and `noted` for those that remember."""

    def __init__(self, body: Body, calibration: Calibration, manner: SolverOptions, leaning: PosturePrior) -> None:
        self.residuals = Residuals(body, calibration, manner.loss)
        self.limits = HingeLimits(body, keep=manner.limits)
        self.solver = IKSolver(self.residuals, self.limits, manner.stopping)
        few = min(_PROBE_STEPS, manner.stopping.most_steps)
        self._first_look = IKSolver(self.residuals, self.limits, replace(manner.stopping, most_steps=few))
        self.qpos = starting_postures(body)[0]
        """(55,) the last answer."""
        self._leaning = leaning
        self._coverage = StatusMonitor(manner.lost_after_s)
        self._gate = OutlierGate(len(calibration.stations), manner.jump_m)
        self._time, self.now_s = DeviceTime(), 0.0
        """The moment of this frame [s]."""
        self._starts = [*starting_postures(body), *([] if leaning.mean_qpos is None else [leaning.mean_qpos])]
        self._started, self._following = False, False
        self._contradicted_since_s: float | None = None

    def track(self, frame: TrackerFrame) -> IKSolution:
        """The pose of a frame that continues what went before; its readings are in `residuals`."""
        return self.solve_with_prior(self.qpos, self.qpos)

    def record(self, frame: TrackerFrame, anew: bool) -> None:
        """`qpos` is the answer to this frame; `anew` when it rests on nothing that went before."""

    def solve_with_prior(self, start: Floats, previous: Floats) -> IKSolution:
        """Inverse kinematics with the weak prior alone."""
        return self.solver.solve(start, self._leaning.prior(self.limits, previous))

    def outlier_share(self) -> float:
        """The share of readings that lie far from the pose."""
        far = (self.residuals.distance > _OUTLIER_SCALES * self.residuals.scale) & self.residuals.measured
        return float(np.count_nonzero(far)) / float(np.count_nonzero(self.residuals.measured))

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.update(frame)
        self.now_s = self._time.frame_time_s(frame)
        if any_seen:
            self._gate.read(frame, self.residuals)
            anew = self._gate.all_moved or (not self._following and (status is Status.SOLVED or not self._started))
            if anew:
                solution = self._solve_cold()
            else:
                solution, anew = self._verify(self.track(frame))
            self.qpos = self._canonical(solution.qpos)
            self._started = True
            self.record(frame, anew)
            self._gate.update(self.residuals, self.qpos)
        self._following = status is Status.SOLVED or (self._following and status is not Status.LOST)
        return Estimate(self.qpos, status)

    def _verify(self, warm: IKSolution) -> tuple[IKSolution, bool]:
        """The pose as it was followed, or one sought anew when the readings contradict it; and whether so."""
        contradicted = self.outlier_share()
        if contradicted == 0.0 and not self._gate.left_out:
            self._contradicted_since_s = None
            return warm, False
        if self._contradicted_since_s is None:
            self._contradicted_since_s = self.now_s
        if contradicted < _OUTLIER_SHARE and (
            self._gate.left_out or self.now_s - self._contradicted_since_s < PATIENCE_S
        ):
            return warm, False
        self._contradicted_since_s = self.now_s
        cold = self._solve_cold()
        return (cold, True) if cold.cost < 0.8 * warm.cost else (warm, False)

    def _solve_cold(self) -> IKSolution:
        """The cheapest pose found from the last one and from the starting postures, stood where the readings are."""
        postures_here = (self.qpos, *self._starts)
        starts = _unique(
            [start for posture in postures_here for start in candidate_placements(self.residuals, posture)]
        )
        self.residuals.widen(_LOSS_SCALE_FACTORS[0])
        looked = [self._first_look.solve(start, self._leaning.prior(self.limits, start)) for start in starts]
        dearest = _PROBE_COST_RATIO * min(solution.cost for solution in looked)
        found: list[IKSolution] = []
        arrived: list[Floats] = []
        for start, solution in zip(starts, looked, strict=True):
            if solution.cost > dearest or not _is_new(solution.qpos, arrived):
                continue
            arrived.append(solution.qpos)
            for factor in _LOSS_SCALE_FACTORS:
                self.residuals.widen(factor)
                solution = self.solve_with_prior(solution.qpos, start)
            found.append(solution)
        return min(found, key=lambda solution: solution.cost)

    def _canonical(self, qpos: Floats) -> Floats:
        """The same pose in lawful angles: past a gimbal's pole the limits hold for the twin."""
        if self.limits.past_gimbal(qpos[7:]):
            qpos = np.concatenate([qpos[:7], self.limits.principal(qpos[7:])])
        return qpos


def _unique(poses: list[Floats]) -> list[Floats]:
    """Those configurations (55,) that none before them is all but equal to."""
    out: list[Floats] = []
    for qpos in poses:
        if _is_new(qpos, out):
            out.append(qpos)
    return out


def _is_new(qpos: Floats, known: list[Floats]) -> bool:
    return all(np.abs(qpos - other).max() > _DUPLICATE_TOLERANCE for other in known)
