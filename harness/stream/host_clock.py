"""Times of measurement on the host's clock, estimated from the device's time stamps."""

from collections.abc import Callable

import numpy as np

from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame

_MAX_DRIFT = 1e-4
"""Greatest relative drift of the two clocks; that of quartz crystals is a tenth of it."""
_CLOCK_RESET_S = 1.0
"""A larger jump of the clock difference is a reset of the device's clock [s], unless a host that stalled is reading
what it missed: then stamps go on, and frames are late for less than this time."""


class HostClockEstimator:
    """Maps device time stamps to the host's clock by the frames with the least delay so far.

    A frame may be delayed but never comes early, so the least difference of the two clocks is the best estimate. The
    estimate increases at the largest drift of the clocks. The least delay from sample to last byte remains in it. Times
    strictly increase: where a frame with less delay corrects the estimate, they wait.
    """

    def __init__(self) -> None:
        self._difference_s = np.inf
        """Least difference of host minus device clock."""
        self._received_s, self._stamp_s = 0.0, -np.inf
        """Time of reception of the latest frame with stamps, and its latest stamp [s]."""
        self._late_since_s: float | None = None
        """When frames began to be later than a reset of the clock would make them [s]."""
        self._measured_s = -np.inf
        """Time of the latest frame [s]."""

    def measured_s(self, frame: TrackerFrame) -> float:
        """Mean time of measurement of stations on the host's monotonic clock [s]; that of reception without stamps."""
        self._measured_s = max(self._estimate_s(frame), float(np.nextafter(self._measured_s, np.inf)))
        return self._measured_s

    def _estimate_s(self, frame: TrackerFrame) -> float:
        stamps_s = frame.measured_s[~np.isnan(frame.measured_s)]
        if len(stamps_s) == 0:
            return frame.received_s
        difference_s = frame.received_s - float(stamps_s[-1])
        drifted_s = self._difference_s + _MAX_DRIFT * max(frame.received_s - self._received_s, 0.0)
        is_reset = self._is_reset(frame.received_s, float(stamps_s[-1]), difference_s - drifted_s)
        self._difference_s = difference_s if is_reset else min(difference_s, drifted_s)
        self._received_s, self._stamp_s = frame.received_s, float(stamps_s[-1])
        return float(stamps_s.mean()) + self._difference_s

    def _is_reset(self, received_s: float, stamp_s: float, jump_s: float) -> bool:
        """Whether the device set its clock anew, by the jump of the clock difference [s]."""
        if jump_s <= _CLOCK_RESET_S:
            self._late_since_s = None
            return jump_s < -_CLOCK_RESET_S
        if self._late_since_s is None:
            self._late_since_s = received_s
        if stamp_s >= self._stamp_s and received_s - self._late_since_s < _CLOCK_RESET_S:
            return False
        self._late_since_s = None
        return True


class UnixTimeEstimator:
    """Times of measurement of stations since 1970, by a host's clock; call it once for each frame, in order."""

    def __init__(self, wall_s: Callable[[float], float]) -> None:
        """`wall_s` converts times on the host's monotonic clock to seconds since 1970."""
        self._wall_s, self._host_clock = wall_s, HostClockEstimator()

    def __call__(self, frame: TrackerFrame) -> Floats:
        """(S,) times of measurement since 1970 [s]; NaN where a station has no stamp, and others have."""
        stamps_s, host_s = frame.measured_s, self._wall_s(self._host_clock.measured_s(frame))
        present = ~np.isnan(stamps_s)
        if not present.any():
            return np.full(len(stamps_s), host_s)
        out: Floats = host_s + (stamps_s - stamps_s[present].mean())
        return out
