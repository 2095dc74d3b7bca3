"""When a frame was measured, by this computer's clock."""

import numpy as np

from harness.stream.frame import TrackerFrame

_MAX_DRIFT = 1e-4
"""How much one clock may gain on the other, as a share: crystals do a tenth of it."""
_CLOCK_RESET_S = 1.0


class HostClockEstimator:
    """Maps the device's stamps to the host's clock by the quickest frames so far.

    A frame can be held up but never comes early, so the least difference of the two clocks is the truest; it is let go
    of as fast as clocks may drift. What even the quickest frame takes from sample to last byte stays in it.
    """

    def __init__(self) -> None:
        self._least_s = np.inf
        """Of host minus device clock."""
        self._before_s = 0.0

    def measured_s(self, frame: TrackerFrame) -> float:
        """The mean of the stations' measuring times by the host's monotonic clock [s]; its reception without stamps."""
        known = frame.measured_s[~np.isnan(frame.measured_s)]
        if len(known) == 0:
            return frame.received_s
        difference_s = frame.received_s - float(known[-1])
        drifted_s = self._least_s + _MAX_DRIFT * max(frame.received_s - self._before_s, 0.0)
        set_anew = abs(difference_s - drifted_s) > _CLOCK_RESET_S
        self._least_s = difference_s if set_anew else min(difference_s, drifted_s)
        self._before_s = frame.received_s
        return float(known.mean()) + self._least_s
