"""Tracking with a history: the last answers, one for each period of the examples."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np

from harness.body import Body
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.core.estimate import Origin
from harness.reconstruct.solver.ground_frame import ground_from_qpos, posture_from_qpos
from harness.reconstruct.solver.ik_session import IKSession, PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution
from harness.reconstruct.solver.reading_prediction import LearnMoments
from harness.reconstruct.solver.subspace import SubspaceSolver
from harness.reconstruct.solver.subspace_minimiser import Subspace
from harness.stream import TrackerFrame


class HistorySession(IKSession, ABC):
    """A `Session` that solves by `solve_next` once its history is long enough, and by inverse kinematics before.

    Examples advance by one period from row to row, so the history must, too. A short gap is filled by `predict_gap`; a
    longer one clears the history. A frame within half a period of the last one replaces it in the history.
    """

    longest_gap: ClassVar[int] = 8
    """Longest gap that is filled, in periods: 0.2 s at 40 Hz, within which a stride or a punch continues."""

    def __init__(
        self,
        body: Body,
        calibration: Calibration,
        options: SolverOptions,
        posture_prior: PosturePrior,
        moments: LearnMoments,
        poses: int,
        rate_hz: float,
    ) -> None:
        super().__init__(body, calibration, options, posture_prior, moments)
        self.past: Floats = np.tile(self.qpos, (poses, 1))
        """(m, 55) the last answers, newest first."""
        self._rate_hz, self._length, self._recorded_s = rate_hz, 0, -np.inf
        self.cold_origin = Origin.FALLBACK
        """Origin of the last cold start."""
        self._unlimited = np.isinf(self.limits.high_rad)
        self._dropped = np.array(self.past[-1])  # the oldest, in case that the newest is replaced

    @abstractmethod
    def solve_next(self) -> IKSolution:
        """The solution for this frame, whose readings are in `residuals`, after `past`."""

    @abstractmethod
    def predict_gap(self) -> Floats:
        """The configuration (55,) one period after `past`, without readings."""

    def track(self, frame: TrackerFrame) -> IKSolution:
        if self._length >= len(self.past):
            periods = round((self.now_s - self._recorded_s) * self._rate_hz)
            if periods == 0:
                self.past[:-1], self.past[-1] = self.past[1:].copy(), self._dropped
            if periods <= self.longest_gap:
                for _ in range(periods - 1):
                    self._push(self.predict_gap())
                return self.solve_next()
            self._length = 0
        return self.solve_without_history(frame)

    def solve_without_history(self, frame: TrackerFrame) -> IKSolution:
        """The solution while the history is too short: by inverse kinematics."""
        self.origin = Origin.FALLBACK
        return super().track(frame)

    def solve_cold(self) -> IKSolution:
        self.cold_origin = Origin.FALLBACK
        return super().solve_cold()

    def solve_from_either(self, solve: Callable[[Floats], IKSolution], first: Floats, second: Floats) -> IKSolution:
        """The solution from the first start, or that from the second if it is cheaper.

        The second start is tried when the first does not converge, or leaves outliers.
        """
        solution = solve(first)
        if solution.converged and self.outlier_share() == 0.0:
            return solution
        other = solve(second)
        best = other if other.cost < solution.cost else solution
        self.residuals.evaluate(best.qpos)
        return best

    def cheapest_in_subspace(self, solver: SubspaceSolver, prior: Subspace, starts: Sequence[Floats]) -> IKSolution:
        """The cheapest solution under a prior, from configurations (55,)."""
        solutions = [solver.solve(prior, ground_from_qpos(start), posture_from_qpos(start)) for start in starts]
        best = min(solutions, key=lambda solution: solution.cost)
        self.residuals.evaluate(best.qpos)
        return best

    def record(self, frame: TrackerFrame, cold: bool) -> None:
        if cold:
            self._length, self.origin = 0, self.cold_origin
        self._push(self.qpos)
        self._recorded_s = self.now_s

    def _push(self, qpos: Floats) -> None:
        """Add a configuration as the newest, in the representation of hinge angles that most examples share."""
        if _push_first(self.past, self._dropped, qpos, self._unlimited):
            self.past[0, 7:] = self.limits.principal(self.past[0, 7:])
        self._length += 1


@compiled
def _push_first(past: Floats, dropped: Floats, qpos: Floats, unlimited: Bools) -> bool:
    """Add a configuration (55,) before others (m, 55); the last of them goes to `dropped`.

    Returns whether any of the `unlimited` hinges (48,) is farther than half a turn from 0.
    """
    dropped[:] = past[-1]
    for age in range(len(past) - 1, 0, -1):
        past[age] = past[age - 1]
    past[0] = qpos
    beyond = False
    for hinge in range(len(unlimited)):
        beyond = beyond or (unlimited[hinge] and abs(qpos[7 + hinge]) > np.pi)
    return beyond
