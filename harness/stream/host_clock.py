"""Times of measurement on the host's clock, estimated from the device's time stamps."""

import numpy as np

from harness.stream.frame import TrackerFrame

_MAX_DRIFT = 1e-4
"""Greatest relative drift of the two clocks; that of quartz crystals is a tenth of it."""
_CLOCK_RESET_S = 1.0
"""A larger jump of the clock difference is a reset of the device's clock [s]."""


class HostClockEstimator:
    """Maps device time stamps to the host's clock by the frames with the least delay so far.

    A frame may be delayed but never comes early, so the least difference of the two clocks is the best estimate. The
    estimate increases at the largest drift of the clocks. The least delay from sample to last byte remains in it. Times
    strictly increase: where a frame with less delay corrects the estimate, they wait.
    """

    def __init__(self) -> None:
        self._difference_s = np.inf
        """Least difference of host minus device clock."""
        self._received_s = 0.0
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
        clock_reset = abs(difference_s - drifted_s) > _CLOCK_RESET_S
        self._difference_s = difference_s if clock_reset else min(difference_s, drifted_s)
        self._received_s = frame.received_s
        return float(stamps_s.mean()) + self._difference_s
