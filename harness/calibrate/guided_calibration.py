"""How a live session comes to know where the trackers are worn, when nobody tells it."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Protocol

from harness.body.humanoid import Body
from harness.body.mounts import Mount
from harness.calibrate.hold import UnusableHold
from harness.calibrate.pose_collector import HOLD_S, PoseCollector
from harness.calibrate.tpose_calibration import TPOSE_S, TPoseCollector, calibrate_tpose
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.stream.frame import TrackerFrame

if TYPE_CHECKING:
    from harness.calibrate.poses import CalibrationPose

Notifier = Callable[[str], None]
"""Tells the user something, in a line."""
MAX_ATTEMPTS = 5
"""A T-pose may fail so often; what keeps failing needs another remedy than patience [choice]."""


class Calibrator(Protocol):
    """Makes a calibration of the first frames of a stream."""

    def begin(self, say: Notifier) -> None:
        """Tell the user what to do."""
        ...

    def add(self, frame: TrackerFrame, say: Notifier) -> Calibration | None:
        """The calibration, once there is enough to go by; HarnessError when there will be none."""
        ...


class TPoseCalibrator:
    """A `Calibrator`: the first seconds in which the performer stands in T-pose."""

    def __init__(self, body: Body, mounts: Sequence[Mount], attempts: int = MAX_ATTEMPTS) -> None:
        self._body, self._mounts = body, mounts
        self._left = attempts
        self._collector = TPoseCollector()

    def begin(self, say: Notifier) -> None:
        say(f"calibration: stand in T-pose, arms out to the sides, palms down, for {TPOSE_S:g} s")

    def add(self, frame: TrackerFrame, say: Notifier) -> Calibration | None:
        """NotStanding after the last attempt."""
        if not self._collector.add(frame):
            return None
        try:
            found = calibrate_tpose(self._collector.frames, self._body, self._mounts)
        except UnusableHold as error:
            self._left -= 1
            if self._left == 0:
                raise
            say(f"calibration: {error} Trying again.")
            self._collector = TPoseCollector()
            return None
        off_mm, moved_mm = 1e3 * float(found.residual_m.max()), 1e3 * float(found.moved_m.max())
        say(f"calibration: done; stations within {off_mm:.0f} mm of the T-pose, still within {moved_mm:.0f} mm")
        return found.calibration


PoseDisplay = Callable[[int, Floats], None]
"""Shows the performer a pose: its number, from 1, and configuration (55,). OSError when it no longer can."""


class PoseGuide:
    """Leads a performer through poses, one after another; `collector.held` has what was held.

    `shown` are their configurations (55,), for `show`.
    """

    def __init__(
        self,
        collector: PoseCollector,
        poses: "Sequence[CalibrationPose]",
        shown: Sequence[Floats] = (),
        show: PoseDisplay | None = None,
    ) -> None:
        self.collector, self._poses, self._shown, self._show = collector, poses, shown, show
        self._passed = 0

    def run(self, frames: Iterable[TrackerFrame], say: Notifier, watch: Notifier = lambda text: None) -> None:
        """Until the last pose is taken; NotStanding when the stream ends before. `watch` is told of every moment."""
        self._announce_pose(say)
        for frame in frames:
            taken = self.collector.add(frame)
            watch(self.collector.message)
            for passed in self.collector.rejected[self._passed :]:
                say(str(passed))
            self._passed = len(self.collector.rejected)
            if taken is not None:
                say(f"pose {taken} of {len(self._poses)} taken, held from {self.collector.began_s[-1]:.1f} s on")
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
                self._show(number + 1, self._shown[number])
            except OSError as error:  # as of any other output, nothing ends for it
                say(f"{error}; the poses are told in words from here on")
                self._show = None


def incomplete_poses_error(collector: PoseCollector, poses: "Sequence[CalibrationPose]") -> UnusableHold:
    """What was held, of a stream that ended before all poses were."""
    taken = ", ".join(f"{at_s:.1f} s" for at_s in collector.began_s)
    held = f"{len(collector.holds)} of {len(poses)} poses were held" + (f", at {taken}" if taken else "")
    passed = "; ".join(map(str, collector.rejected))
    wanted = poses[len(collector.holds)]
    return UnusableHold(
        f"The stream ended before calibration was done: {held}{f'; {passed}' if passed else ''}.",
        f"Hold each pose still for {HOLD_S:g} s, in order; the next was {wanted.name!r}.",
    )
