"""How a live session comes to know where the trackers are worn, when nobody tells it."""

from collections.abc import Callable, Sequence
from typing import Protocol

from harness.body.humanoid import Body
from harness.body.mounts import Mount
from harness.calibrate.still import NotStanding
from harness.calibrate.tpose import SECONDS, TPoseCollector, calibrate_tpose
from harness.core.calibration import Calibration
from harness.stream.frame import TrackerFrame

Say = Callable[[str], None]
"""Tells the user something, in a line."""
ATTEMPTS = 5
"""A T-pose may fail so often; what keeps failing needs another remedy than patience [choice]."""


class Calibrator(Protocol):
    """Makes a calibration of the first frames of a stream."""

    def begin(self, say: Say) -> None:
        """Tell the user what to do."""
        ...

    def add(self, frame: TrackerFrame, say: Say) -> Calibration | None:
        """The calibration, once there is enough to go by; HarnessError when there will be none."""
        ...


class StandInTPose:
    """A `Calibrator`: the first seconds in which the performer stands in T-pose."""

    def __init__(self, body: Body, mounts: Sequence[Mount], attempts: int = ATTEMPTS) -> None:
        self._body, self._mounts = body, mounts
        self._left = attempts
        self._collector = TPoseCollector()

    def begin(self, say: Say) -> None:
        say(f"calibration: stand in T-pose, arms out to the sides, palms down, for {SECONDS:g} s")

    def add(self, frame: TrackerFrame, say: Say) -> Calibration | None:
        """NotStanding after the last attempt."""
        if not self._collector.add(frame):
            return None
        try:
            found = calibrate_tpose(self._collector.frames, self._body, self._mounts)
        except NotStanding as error:
            self._left -= 1
            if self._left == 0:
                raise
            say(f"calibration: {error} Trying again.")
            self._collector = TPoseCollector()
            return None
        off_mm, moved_mm = 1e3 * float(found.residual_m.max()), 1e3 * float(found.moved_m.max())
        say(f"calibration: done; stations within {off_mm:.0f} mm of the T-pose, still within {moved_mm:.0f} mm")
        return found.calibration
