"""What a session does with a frame before it solves: status, outlier gate, temporal alignment, silent stations.

All methods with an outlier gate read their frames through it. The gate comes first and compares readings as measured.
What it lets through is moved to the frame's instant, where the method asks for it. Stations that the frame lacks are
predicted last.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import specialise
from harness.core.estimate import Status
from harness.reconstruct.solver.outlier_gate import JUMP_M, OutlierGate
from harness.reconstruct.solver.reading_prediction import IncrementMoments, ReadingPrediction
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.status_monitor import DeviceTime, StatusMonitor
from harness.reconstruct.solver.temporal_alignment import TemporalAlignment, measure_offsets
from harness.stream import TrackerFrame

SURE_M = 0.15
"""A silent station counts as reporting while the standard deviation of its predicted position is less [m] [choice]."""


class SessionReader:
    """Reads the frames of one session into residuals."""

    def __init__(
        self, residuals: Residuals, moments: IncrementMoments, jump_m: float = JUMP_M, *, align: bool = False
    ) -> None:
        stations = len(residuals.bones)
        self.residuals, self.clock = residuals, DeviceTime()
        self.gate = OutlierGate(stations, jump_m, clock=self.clock)
        self._monitor = StatusMonitor(self.clock)
        self._alignment = TemporalAlignment(stations) if align else None
        self._prediction = ReadingPrediction(moments)
        self._slot_s, self._offset_s = np.full(stations, np.nan), np.zeros(stations)
        self._measure_offsets = specialise(
            measure_offsets, np.zeros(stations), np.zeros(stations, bool), self._slot_s, self._offset_s
        )

    def read(self, frame: TrackerFrame) -> tuple[Status, bool]:
        """Read a frame; its status, and whether it has any valid reading. Without one the residuals are unchanged."""
        if not (frame.position_valid.any() or frame.orientation_valid.any()):
            return self._monitor.update(frame)
        residuals = self.residuals
        offset_s = self._offset_s
        instant_s = self._measure_offsets(frame.measured_s, frame.suspect, self._slot_s, offset_s)
        self.gate.read(frame, residuals, offset_s if self._alignment else None)
        self._prediction.record(residuals, frame.measured_s, frame.suspect)
        if self._alignment:
            self._alignment.align(frame, residuals, offset_s)
        self._prediction.complete(residuals, frame, instant_s, offset_s)
        return self._monitor.update(frame, residuals.count_sure(SURE_M))

    def update(self, qpos: Floats) -> None:
        """Take the configuration (55,) that answers the frame read last."""
        self.gate.update(self.residuals, qpos)
