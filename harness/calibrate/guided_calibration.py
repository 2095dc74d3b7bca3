"""Calibration at the start of a session: from a T-pose, or guided through a list of poses."""

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

from harness.body.humanoid import Body
from harness.body.mounts import Mount
from harness.calibrate.hold import UnusableHold
from harness.calibrate.pose_collector import HOLD_S, PoseCollector
from harness.calibrate.poses import CalibrationPose
from harness.calibrate.tpose_calibration import TPOSE_S, TPoseCollector, calibrate_tpose
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.stream.frame import TrackerFrame

Notifier = Callable[[str], None]
"""Shows the user one line of text."""
MAX_ATTEMPTS = 5
"""Number of T-poses that may fail before calibration is given up [choice]."""


class Calibrator(Protocol):
    """Computes a calibration from the first frames of a stream."""

    def begin(self, say: Notifier) -> None:
        """Tell the user what to do."""
        ...

    def add(self, frame: TrackerFrame, say: Notifier) -> Calibration | None:
        """Add a frame; returns the calibration once it is known. HarnessError if calibration has failed."""
        ...


class TPoseCalibrator:
    """A `Calibrator` from the first seconds in which the performer stands still in T-pose."""

    def __init__(self, body: Body, mounts: Sequence[Mount], attempts: int = MAX_ATTEMPTS) -> None:
        self._body, self._mounts = body, mounts
        self._attempts_left = attempts
        self._collector = TPoseCollector()

    def begin(self, say: Notifier) -> None:
        say(f"calibration: stand in T-pose, arms out to the sides, palms down, for {TPOSE_S:g} s")

    def add(self, frame: TrackerFrame, say: Notifier) -> Calibration | None:
        """Add a frame; UnusableHold after the last attempt."""
        if not self._collector.add(frame):
            return None
        try:
            result = calibrate_tpose(self._collector.frames, self._body, self._mounts)
        except UnusableHold as error:
            self._attempts_left -= 1
            if self._attempts_left == 0:
                raise
            say(f"calibration: {error} Trying again.")
            self._collector = TPoseCollector()
            return None
        residual_mm, moved_mm = 1e3 * float(result.residual_m.max()), 1e3 * float(result.moved_m.max())
        say(
            f"calibration: done; stations are within {residual_mm:.0f} mm of the T-pose and moved by at most "
            f"{moved_mm:.0f} mm"
        )
        return result.calibration


PoseDisplay = Callable[[int, Floats], None]
"""Shows the performer a pose, given its number (from 1) and configuration (55,). Raises OSError if it fails."""


class PoseGuide:
    """Guides a performer through poses, one after another; `collector.holds` has the recorded holds."""

    def __init__(
        self,
        collector: PoseCollector,
        poses: Sequence[CalibrationPose],
        configurations: Sequence[Floats] = (),
        show: PoseDisplay | None = None,
    ) -> None:
        """`configurations` are those of the poses (55,), which `show` displays."""
        self.collector, self._poses, self._configurations, self._show = collector, poses, configurations, show
        self._rejected_count = 0

    def run(self, frames: Iterable[TrackerFrame], say: Notifier, watch: Notifier = lambda text: None) -> None:
        """Run until the last pose is recorded; UnusableHold if the stream ends before.

        `say` gets the instructions and results, `watch` the state of the collector at every frame.
        """
        self._announce_pose(say)
        for frame in frames:
            recorded = self.collector.add(frame)
            watch(self.collector.message)
            for rejected in self.collector.rejected[self._rejected_count :]:
                say(str(rejected))
            self._rejected_count = len(self.collector.rejected)
            if recorded is not None:
                say(f"pose {recorded} of {len(self._poses)} taken, held from {self.collector.began_s[-1]:.1f} s on")
                if self.collector.done:
                    return
                self._announce_pose(say)
        raise incomplete_poses_error(self.collector, self._poses)

    def _announce_pose(self, say: Notifier) -> None:
        number = len(self.collector.holds)
        pose = self._poses[number]
        say(f"pose {number + 1} of {len(self._poses)}, {pose.name}: {pose.instruction}")
        if self._show is not None:
            try:
                self._show(number + 1, self._configurations[number])
            except OSError as error:  # a failed display does not end the calibration
                say(f"{error}; from here on, poses are described in words only")
                self._show = None


def incomplete_poses_error(collector: PoseCollector, poses: Sequence[CalibrationPose]) -> UnusableHold:
    """The error for a stream that ended before all poses were held; it lists the holds."""
    times = ", ".join(f"{start_s:.1f} s" for start_s in collector.began_s)
    held = f"{len(collector.holds)} of {len(poses)} poses were held" + (f", at {times}" if times else "")
    rejected = "; ".join(map(str, collector.rejected))
    missing = poses[len(collector.holds)]
    return UnusableHold(
        f"The stream ended before calibration was done: {held}{f'; {rejected}' if rejected else ''}.",
        f"Hold each pose still for {HOLD_S:g} s, in order; the next was {missing.name!r}.",
    )
