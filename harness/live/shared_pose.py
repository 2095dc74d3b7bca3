"""Data that the session and the viewer's process share: the newest pose, the viewer's settings and its messages."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.live.pose import LivePose

ViewerKind = Literal["window", "frames"]
READY, CLOSED = "ready", "its window was closed"
"""Messages of the viewer's process: the first picture was drawn; the user closed the window."""
CONFIGURATION = slice(3, 58)
"""Place of the configuration in the record of `SharedPose`; before it stand number, time and status."""
BESIDE, STILL_SHARE = slice(58, 113), 113
"""Place of a second configuration, NaN for none, and of the share of a hold that is complete, NaN for none."""
_RECORD_SIZE = 114


@dataclass(frozen=True)
class ViewerConfig:
    """What the viewer's process draws, and where."""

    kind: ViewerKind
    bone_m: Floats
    """(B, 3) bone vectors of the body [m]."""
    out: str
    """Folder of the pictures; empty for a window."""
    rate_hz: float
    """Most pictures per second [Hz]."""


class SharedPose:
    """The newest pose in memory that two processes share, and the performer beside it during a guided calibration."""

    def __init__(self, context: Any) -> None:
        """`context` is a `multiprocessing` context."""
        self._lock = context.Lock()
        self._memory = context.RawArray("d", _RECORD_SIZE)
        self._memory[0] = -1.0
        self._memory[BESIDE.start :] = [np.nan] * (_RECORD_SIZE - BESIDE.start)

    def put(self, pose: LivePose) -> None:
        """Store a pose, or drop it while the other process reads: this call never waits."""
        if self._lock.acquire(block=False):
            try:
                self._fill(pose.number, pose.measured_s, pose.estimate.status, pose.estimate.qpos)
            finally:
                self._lock.release()

    def set(self, number: int, qpos: Floats, beside: Floats | None = None, still_share: float = np.nan) -> None:
        """Store a configuration (55,) that belongs to no time, another (55,) that is drawn beside it, and the meter.

        Waits while the other process reads.
        """
        with self._lock:
            self._fill(number, 0.0, Status.SOLVED, qpos)
            self._memory[BESIDE] = np.full(55, np.nan) if beside is None else beside
            self._memory[STILL_SHARE] = still_share

    def _fill(self, number: int, time_s: float, status: Status, qpos: Floats) -> None:
        self._memory[:3] = [number, time_s, status]
        self._memory[CONFIGURATION] = qpos

    def get(self) -> Floats:
        """The record (114,): number, time [s], status, `qpos`, the configuration beside it, and the meter.

        The number is -1 before the first pose.
        """
        with self._lock:
            return np.array(self._memory)
