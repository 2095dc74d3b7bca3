"""The outlier gate: it leaves out a position that jumps away from the predicted one (docs/notes/traps.md F7).

A robust loss alone cannot reject an echo: under a wide prior the limb simply follows it. The prediction extrapolates
the estimated body, not the readings. Over one period at 40 Hz even a punch (100 m/s^2) departs only 6 cm from its last
velocity. When many positions jump at once, the performer has moved; after `patience_s` a reading is accepted anyway.
"""

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.reconstruct.features.device_time import DeviceTime
from harness.reconstruct.solver.residuals import Residuals
from harness.stream.frame import TrackerFrame

JUMP_M, PATIENCE_S = 0.15, 0.25
"""More than motion departs from a prediction within a period; longer than a burst of echoes (8 records at 40 Hz)."""
_MAX_PERIOD_S = 0.1
"""After a longer gap no position is predicted."""


class OutlierGate:
    """The outlier gate for the positions of S stations, for one session."""

    def __init__(self, stations: int, jump_m: float = JUMP_M, patience_s: float = PATIENCE_S) -> None:
        self._jump_m, self._patience_s = jump_m, patience_s
        self._station_m: Floats = np.zeros((stations, 3))
        self._velocity_m_s: Floats = np.zeros((stations, 3))
        self._accepted_at_s: Floats = np.full(stations, -np.inf)
        self._updated_at_s, self._moving = -np.inf, False
        self._time, self._now_s = DeviceTime(), -np.inf
        self.left_out = False
        """Whether anything was left out of the last frame."""
        self.all_moved = False
        """Whether at least half of the last frame's positions jumped, so that the performer has moved."""

    def read(self, frame: TrackerFrame, residuals: Residuals) -> None:
        """Let the residuals read a frame, then leave out the positions that jumped."""
        residuals.read(frame)
        self._now_s = self._time.frame_time_s(frame)
        jumped = self.find_jumps(self._now_s, residuals.target_m, frame.position_valid)
        self.left_out = bool(np.count_nonzero(jumped))
        if self.left_out:
            residuals.leave_out(np.concatenate([jumped, np.zeros_like(jumped)]))

    def update(self, residuals: Residuals, qpos: Floats) -> None:
        """Take the configuration (55,) that answers the frame read last, for the next prediction."""
        residuals.evaluate(qpos)
        self.update_stations(self._now_s, residuals.station_m)

    def find_jumps(self, now_s: float, target_m: Floats, measured: Bools) -> Bools:
        """(S,) which of the measured positions `target_m` (S, 3), in the world [m], to leave out of this frame."""
        out, self.all_moved = np.zeros(len(measured), bool), False
        period_s = now_s - self._updated_at_s
        if self._moving and 0.0 < period_s <= _MAX_PERIOD_S:
            expected_m = self._station_m + period_s * self._velocity_m_s
            self.all_moved = _find_jumps(
                *(target_m, measured, expected_m, self._jump_m),
                *(now_s, self._patience_s, self._accepted_at_s, out),
            )
        else:
            self._accepted_at_s[:] = now_s
        return out

    def update_stations(self, now_s: float, station_m: Floats) -> None:
        """Take the stations' positions (S, 3) in the answer to this frame [m]."""
        period_s = now_s - self._updated_at_s
        self._moving = 0.0 < period_s <= _MAX_PERIOD_S
        if self._moving:
            self._velocity_m_s = (station_m - self._station_m) / period_s
        self._station_m, self._updated_at_s = station_m.copy(), now_s


@compiled
def _find_jumps(
    target_m: Floats,
    measured: Bools,
    expected_m: Floats,
    jump_m: float,
    now_s: float,
    patience_s: float,
    accepted_at_s: Floats,
    out: Bools,
) -> bool:
    """Fill in which measured positions (S,) are farther than a jump from the expected ones, and not for too long.

    Returns whether at least half of the measured ones are; then none is left out. The others are accepted now.
    """
    far = 0
    for s in range(len(out)):
        squared = 0.0
        for i in range(3):
            squared += (target_m[s, i] - expected_m[s, i]) ** 2
        out[s] = measured[s] and squared > jump_m**2
        far += out[s]
        if not out[s]:
            accepted_at_s[s] = now_s
    all_moved = bool(far > 0 and 2 * far >= measured.sum())
    for s in range(len(out)):
        out[s] = out[s] and not all_moved and now_s - accepted_at_s[s] <= patience_s
    return all_moved
