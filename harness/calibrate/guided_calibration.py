"""Guided calibration: a performer is led through a list of poses."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from harness.calibrate.hold import UnusableHold
from harness.calibrate.performer_preview import PerformerPose, PerformerPreview
from harness.calibrate.pose_collector import CHECK_EVERY_S, HOLD_S, PoseCollector
from harness.calibrate.poses import CalibrationPose
from harness.core.arrays import Floats
from harness.stream import TrackerFrame

Notifier = Callable[[str], None]
"""Shows the user one line of text."""


@dataclass(frozen=True, eq=False)
class GuidedPose:
    """What a display shows while the performer is asked for a pose."""

    number: int
    """Number of the pose, from 1."""
    target: Floats
    """(55,) configuration of the wanted pose."""
    performer: PerformerPose | None
    """The performer's approximate pose; None before every station has reported."""
    farthest: str
    """Name of the station that is farthest from its place in the wanted pose; empty without `performer`."""
    still_s: float
    """Time for which the performer has been still [s]; `HOLD_S` completes a hold."""
    message: str
    """State of the collector in one sentence."""

    @property
    def still_share(self) -> float:
        """Share of a hold that is complete, 0 to 1."""
        return min(self.still_s / HOLD_S, 1.0)

    def distance_text(self) -> str:
        """The station that is farthest from its place, and how far."""
        if self.performer is None:
            return "waiting for all stations"
        return f"{self.farthest} is {1e2 * self.performer.distance_m.max():.0f} cm from its place in the pose"


class PoseDisplay(Protocol):
    """Shows the wanted pose and the performer."""

    def show(self, guided: GuidedPose) -> None:
        """Show the newest state. OSError when the display is gone."""
        ...


class PoseGuide:
    """Guides a performer through poses, one after another; `collector.holds` has the recorded holds."""

    def __init__(
        self,
        collector: PoseCollector,
        poses: Sequence[CalibrationPose],
        configurations: Sequence[Floats] = (),
        displays: Sequence[PoseDisplay] = (),
        preview: PerformerPreview | None = None,
    ) -> None:
        """`configurations` are those of the poses (55,), which displays show; displays need them and a `preview`."""
        self.collector, self._poses, self._configurations = collector, poses, configurations
        self._displays, self._preview = list(displays), preview
        self._rejected_count = 0
        self._shown_s = -np.inf

    def run(self, frames: Iterable[TrackerFrame], say: Notifier) -> None:
        """Run until the last pose is recorded; UnusableHold if the stream ends before.

        `say` gets the instructions and results. Displays are updated every `CHECK_EVERY_S`.
        """
        self._announce_pose(say)
        for frame in frames:
            recorded = self.collector.add(frame)
            for rejected in self.collector.rejected[self._rejected_count :]:
                say(str(rejected))
            self._rejected_count = len(self.collector.rejected)
            if recorded is not None:
                taken = f"pose {recorded} of {len(self._poses)} taken, held from {self.collector.began_s[-1]:.1f} s on"
                say(taken if self.collector.holds[-1] else self.collector.message)
                if self.collector.done:
                    return
                self._announce_pose(say)
            elif frame.received_s - self._shown_s >= CHECK_EVERY_S:
                self._shown_s = frame.received_s
                self._show(frame, say)
        raise incomplete_poses_error(self.collector, self._poses)

    def _announce_pose(self, say: Notifier) -> None:
        number = len(self.collector.holds)
        pose = self._poses[number]
        say(f"pose {number + 1} of {len(self._poses)}, {pose.name}: {pose.instruction}")
        self._show(None, say)

    def _show(self, frame: TrackerFrame | None, say: Notifier) -> None:
        if not self._displays:
            return
        wanted, performer, farthest = len(self.collector.holds), None, ""
        if frame is not None and self._preview is not None:
            performer = self._preview.estimate(wanted, frame)
        if performer is not None:
            farthest = self.collector.stations[int(np.argmax(performer.distance_m))]
        target = self._configurations[wanted]
        still_s = 0.0 if frame is None else self.collector.still_s()
        guided = GuidedPose(wanted + 1, target, performer, farthest, still_s, self.collector.message)
        for display in tuple(self._displays):
            try:
                display.show(guided)
            except OSError as error:  # a failed display does not end the calibration
                say(f"{error}; from here on, it does not show the poses")
                self._displays.remove(display)


def incomplete_poses_error(collector: PoseCollector, poses: Sequence[CalibrationPose]) -> UnusableHold:
    """The error for a stream that ended before all poses were held; it lists the holds."""
    times = ", ".join(f"{start_s:.1f} s" for start_s in collector.began_s)
    held = f"{len(collector.began_s)} of {len(poses)} poses were held" + (f", at {times}" if times else "")
    rejected = "; ".join(map(str, collector.rejected))
    missing = poses[len(collector.holds)]
    return UnusableHold(
        f"The stream ended before calibration was done: {held}{f'; {rejected}' if rejected else ''}.",
        f"Hold each pose still for {HOLD_S:g} s, in order; the next was {missing.name!r}.",
    )
