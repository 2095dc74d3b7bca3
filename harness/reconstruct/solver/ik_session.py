"""Inverse kinematics over a take: what all sessions that solve for poses have in common.

Each frame is solved from the pose of the frame before (warm start). A cold start solves from the T-pose, a few other
postures and the last pose, without trust in the past. It happens at the start, after a loss, when most readings jump at
once, and when readings keep contradicting the pose. The solution of lower cost is used.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated

import numpy as np

from harness.body import Body
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.estimate import Estimate, Origin, Status
from harness.core.ranges import Range
from harness.reconstruct.solver.frame_reader import SessionReader
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.ik_solver import IKSolution, IKSolver, Prior, Stopping
from harness.reconstruct.solver.outlier_gate import JUMP_M, PATIENCE_S
from harness.reconstruct.solver.reading_prediction import LearnMoments
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import candidate_placements, starting_postures
from harness.stream import TrackerFrame

POSTURE_PRIOR_SIGMA_RAD = float(np.deg2rad(30.0))
"""Standard deviation of hinges about the examples' mean posture, for methods without a history yet [rad]."""
_CONTRADICTION_M, _CONTRADICTION_RAD = 0.06, float(np.deg2rad(16.0))
"""A reading contradicts the pose when its residual is larger. It depends on no option of a method: a narrow loss or
prior would reject every answer of its own model."""
_OUTLIER_SHARE = 0.25
"""From this share of contradicting readings on, a cold start follows at once; below it, after `PATIENCE_S`."""
_LOSS_SCALE_FACTORS = (10.0, 3.0, 1.0)
"""Successive factors on the Lorentzian's scale in a cold start, so that distant readings attract at first."""
_PROBE_STEPS, _PROBE_COST_RATIO = 6, 3.0
"""Each start is solved for this many steps. It is dropped if it then costs this many times as much as the cheapest one:
most have nearly converged by then, and those that are upside down never will."""
_DUPLICATE_TOLERANCE = 1e-3
"""Configurations whose numbers all differ by less count as one [m, rad]."""
_COLD_COST_RATIO = 0.8
"""A cold solution replaces a warm one when it costs less than this share of it."""


@dataclass(frozen=True, eq=False)
class PosturePrior:
    """A weak prior on hinges, for what trackers leave open and no example determines. The root has none."""

    mean_qpos: Floats | None
    """(55,) mean posture of examples; None without examples."""
    spread_rad: Floats
    """(48,) standard deviation of each hinge; inf for no prior."""
    towards_mean: float = 1.0
    """Position of the prior's mean between the previous pose, 0, and the mean posture, 1."""

    @cached_property
    def precision(self) -> Floats:
        """(54,) precision of the prior along each tangent direction; 0 for the root [1/rad^2]."""
        return np.concatenate([np.zeros(6), self.spread_rad**-2.0])

    def prior(self, limits: HingeLimits, previous: Floats) -> Prior:
        """The prior after a previous pose (55,)."""
        if self.mean_qpos is None:
            return Prior(previous, self.precision)
        return Prior(limits.between(previous, self.mean_qpos, self.towards_mean), self.precision)


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """Options that all methods share which solve for poses. What is no field here is an option of one of them."""

    loss: Loss = field(default_factory=Loss)
    """Scales and robust loss of the residuals."""
    jump_m: Annotated[float, Range(0.0, math.inf)] = JUMP_M
    """Outlier gate: a position this far from its prediction is left out for a while [m]; inf disables the gate."""
    align: bool = False
    """Move the readings of all stations to one instant before anything else uses them (`temporal_alignment`)."""
    stopping: Stopping = field(default_factory=Stopping)
    """Convergence criteria of the solver."""
    limits = True
    """Keep hinges within the body's limits."""
    restart = True
    """Whether a cold start follows when readings contradict the pose for long; if not, only after a loss."""


class IKSession:
    """A `Session` by inverse kinematics. Methods override `track`, and `record` if they keep a history."""

    def __init__(
        self,
        body: Body,
        calibration: Calibration,
        options: SolverOptions,
        posture_prior: PosturePrior,
        moments: LearnMoments,
    ) -> None:
        self.residuals = Residuals(body, calibration, options.loss)
        self.limits = HingeLimits(body, keep=options.limits)
        self.solver = IKSolver(self.residuals, self.limits, options.stopping)
        probe_steps = min(_PROBE_STEPS, options.stopping.most_steps)
        self._probe = IKSolver(self.residuals, self.limits, replace(options.stopping, most_steps=probe_steps))
        postures = starting_postures(body)
        self.qpos = postures[0]
        """(55,) the last answer."""
        self._posture_prior = posture_prior
        self._restart = options.restart
        self._reader = SessionReader(self.residuals, moments(calibration), options.jump_m, align=options.align)
        self.now_s = 0.0
        """Time of this frame [s]."""
        self._postures = postures if posture_prior.mean_qpos is None else (*postures, posture_prior.mean_qpos)
        self._contradiction = np.repeat([_CONTRADICTION_M, _CONTRADICTION_RAD], len(calibration.stations))
        """(2S,) residuals from which on a position or an orientation contradicts the pose [m, rad]."""
        self._started, self._tracking = False, False
        self.origin = Origin.MODEL
        """Origin of the answer to this frame. Methods with a model set it when inverse kinematics answers instead."""
        self._contradicted_since_s: float | None = None

    def track(self, frame: TrackerFrame) -> IKSolution:
        """The solution of a frame that continues the last one; its readings are in `residuals`."""
        return self.solve_with_prior(self.qpos, self.qpos)

    def record(self, frame: TrackerFrame, cold: bool) -> None:
        """Called when `qpos` answers this frame; `cold` after a cold start, which depends on no earlier frame."""

    def solve_with_prior(self, start: Floats, previous: Floats) -> IKSolution:
        """Inverse kinematics from a start (55,) with the posture prior after a previous pose (55,)."""
        return self.solver.solve(start, self._posture_prior.prior(self.limits, previous))

    def outlier_share(self) -> float:
        """The share of rows measured in this frame that contradict the pose evaluated last."""
        residuals = self.residuals
        return _share_beyond(residuals.state.squared, self._contradiction, residuals.fresh)

    def step(self, frame: TrackerFrame) -> Estimate:
        """The estimate after one frame; without any valid reading, the last pose again."""
        status, any_valid = self._reader.read(frame)
        self.origin = Origin.MODEL if any_valid else Origin.BRIDGED
        self.now_s = self._reader.clock.frame_time_s(frame)
        if any_valid:
            cold = self._reader.gate.all_moved or (
                not self._tracking and (status is Status.SOLVED or not self._started)
            )
            if cold:
                solution = self.solve_cold()
            else:
                solution, cold = self._verify(self.track(frame))
            self.qpos = self._canonical(solution.qpos)
            self._started = True
            self.record(frame, cold)
            self._reader.update(self.qpos)
        self._tracking = status is Status.SOLVED or (self._tracking and status is not Status.LOST)
        return Estimate(self.qpos, status, self.origin)

    def _verify(self, warm: IKSolution) -> tuple[IKSolution, bool]:
        """The warm solution, or a cold one if readings contradict the warm one for too long; and whether it is cold."""
        contradicting = self.outlier_share() if self._restart else 0.0
        if contradicting == 0.0 and not self._reader.gate.left_out:
            self._contradicted_since_s = None
            return warm, False
        if self._contradicted_since_s is None:
            self._contradicted_since_s = self.now_s
        if contradicting < _OUTLIER_SHARE and (
            self._reader.gate.left_out or self.now_s - self._contradicted_since_s < PATIENCE_S
        ):
            return warm, False
        self._contradicted_since_s = self.now_s
        cold = self.solve_cold()
        return (cold, True) if cold.cost < _COLD_COST_RATIO * warm.cost else (warm, False)

    def solve_cold(self) -> IKSolution:
        """The cheapest solution from the last pose and the starting postures, each placed at the readings."""
        starts: list[Floats] = []
        for posture in (self.qpos, *self._postures):
            for start in candidate_placements(self.residuals, posture):
                if _is_new(start, starts):
                    starts.append(start)
        self.residuals.widen(_LOSS_SCALE_FACTORS[0])
        probes = [self._probe.solve(start, self._posture_prior.prior(self.limits, start)) for start in starts]
        max_cost = _PROBE_COST_RATIO * min(solution.cost for solution in probes)
        solutions: list[IKSolution] = []
        reached: list[Floats] = []
        for start, solution in zip(starts, probes, strict=True):
            if solution.cost > max_cost or not _is_new(solution.qpos, reached):
                continue
            reached.append(solution.qpos)
            for factor in _LOSS_SCALE_FACTORS:
                self.residuals.widen(factor)
                solution = self.solve_with_prior(solution.qpos, start)
            solutions.append(solution)
        return min(solutions, key=lambda solution: solution.cost)

    def _canonical(self, qpos: Floats) -> Floats:
        """The pose in principal hinge angles, for which the limits hold also beyond a gimbal's pole."""
        if self.limits.past_gimbal(qpos[7:]):
            qpos = np.concatenate([qpos[:7], self.limits.principal(qpos[7:])])
        return qpos


@compiled
def _share_beyond(squared: Floats, limit: Floats, measured: Bools) -> float:
    """The share of the measured rows (N,) whose square exceeds that of its limit (N,)."""
    beyond, count = 0, 0
    for row in range(len(squared)):
        count += measured[row]
        beyond += measured[row] and squared[row] > limit[row] ** 2
    return beyond / count


def _is_new(qpos: Floats, known: list[Floats]) -> bool:
    """Whether a configuration (55,) differs from all others."""
    return all(np.abs(qpos - other).max() > _DUPLICATE_TOLERANCE for other in known)
