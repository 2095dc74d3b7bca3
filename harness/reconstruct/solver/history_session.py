"""Following a performer with a memory: the last answers, one for each period of the examples."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.reconstruct.solver.ik_session import IKSession, PosturePrior, SolverOptions
from harness.reconstruct.solver.ik_solver import IKSolution
from harness.stream.frame import TrackerFrame


class HistorySession(IKSession, ABC):
    """A `Session` that answers by `continued` as soon as it has enough of a past, and by inverse kinematics before.

    Examples advance by one period from row to row, so the past must, too: over a short gap it is filled by what
    `bridged` says, after a longer one it begins anew; a frame that comes within half a period replaces the last.
    """

    longest_gap: ClassVar[int] = 8
    """Periods that a gap may last: 0.2 s at 40 Hz, over which a stride or a punch is still the same."""

    def __init__(
        self,
        body: Body,
        calibration: Calibration,
        manner: SolverOptions,
        leaning: PosturePrior,
        poses: int,
        rate_hz: float,
    ) -> None:
        super().__init__(body, calibration, manner, leaning)
        self.past: Floats = np.tile(self.qpos, (poses, 1))
        """(m, 55) the last answers, newest first."""
        self._rate_hz, self._known, self._noted_s = rate_hz, 0, -np.inf
        self._free = np.isinf(self.limits.high_rad)
        self._replaced = np.array(self.past[-1])

    @abstractmethod
    def solve_next(self) -> IKSolution:
        """The pose that follows `past`."""

    @abstractmethod
    def predict_gap(self) -> Floats:
        """The configuration (55,) that follows `past` when nothing was read."""

    def track(self, frame: TrackerFrame) -> IKSolution:
        if self._known >= len(self.past):
            periods = round((self.now_s - self._noted_s) * self._rate_hz)
            if periods == 0:
                self.past[:-1], self.past[-1] = self.past[1:].copy(), self._replaced
            if periods <= self.longest_gap:
                for _ in range(periods - 1):
                    self._remember(self.predict_gap())
                return self.solve_next()
            self._known = 0
        return super().track(frame)

    def record(self, frame: TrackerFrame, anew: bool) -> None:
        self._known = 0 if anew else self._known
        self._remember(self.qpos)
        self._noted_s = self.now_s

    def _remember(self, qpos: Floats) -> None:
        """In the representation that most examples share."""
        qpos = np.array(qpos)
        if np.abs(qpos[7:][self._free]).max(initial=0.0) > np.pi:
            qpos[7:] = self.limits.principal(qpos[7:])
        self._replaced = np.array(self.past[-1])
        self.past[1:] = self.past[:-1].copy()
        self.past[0] = qpos
        self._known += 1
