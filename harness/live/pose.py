"""The input of outputs: what a session is of, and each estimate with its posed body and its times."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from harness.body import Body, Kinematics
from harness.calibrate import CalibrationOutcome, CalibrationPose, Notifier, PoseCollector, PoseDisplay
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Estimate
from harness.core.skeleton import Skeleton
from harness.stream import TrackerFrame


class GuidedCalibration(Protocol):
    """A calibration of the performer by held poses, as `experiment.CalibrationSession` is one. It can be pickled."""

    @property
    def poses(self) -> tuple[CalibrationPose, ...]: ...

    @property
    def body(self) -> Body:
        """The body that shows the poses."""
        ...

    def collect_poses(
        self, frames: Iterable[TrackerFrame], say: Notifier, displays: Sequence[PoseDisplay] = ()
    ) -> PoseCollector:
        """Guide the performer through the poses; UnusableHold when the frames end before the last pose."""
        ...

    def solve(self, held: Sequence[Sequence[TrackerFrame]], source: str) -> CalibrationOutcome:
        """Solve for the calibration. UnusableHold, BadInput."""
        ...


@dataclass(frozen=True, eq=False)
class SessionSetup:
    """What outputs show of a live session beside its poses."""

    skeleton: Skeleton
    stations: tuple[str, ...]
    rate_hz: float
    """Expected frame rate of the tracker [Hz]."""
    title: str
    calibrations: Mapping[str, GuidedCalibration] = field(default_factory=dict)
    """Calibrations by poses that the page of the session offers, by kind."""


@dataclass(frozen=True, eq=False)
class LivePose:
    """One solved frame of a live session: the frame that the estimate answers, which may be earlier than that of the
    step.
    """

    number: int
    """Number of the pose, from 0; dropped frames are not counted."""
    frame: TrackerFrame
    taken_s: float
    """Host monotonic clock when the frame of the step was taken from the queue, when the estimate was made [s]."""
    ready_s: float
    """Host monotonic clock when the pose was ready [s]."""
    measured_s: float
    """Host monotonic clock at the time of measurement, by the device's stamps (`clock.HostClockEstimator`) [s]."""
    estimate: Estimate
    kinematics: Kinematics
    """Shared by all poses of a session and set to this pose on first use; for one thread only."""
    room: tuple[Floats, Floats] | None = None
    """The tracker's origin in the world (3,) [m], and `world_from_tracker` (4,); None if they are not known."""

    @cached_property
    def bones(self) -> tuple[Floats, Floats]:
        """Joint positions (24, 3) [m] and `world_from_bone` (24, 4)."""
        self.kinematics.set(self.estimate.qpos)
        return self.kinematics.bone_poses()

    @property
    def device_s(self) -> float:
        """Mean of the stations' stamps on the device's clock [s]; the time of reception without stamps."""
        stamps_s = self.frame.measured_s[~np.isnan(self.frame.measured_s)]
        return float(stamps_s.mean()) if len(stamps_s) else self.frame.received_s

    @property
    def root_m(self) -> Floats:
        """(3,) position of the root [m]."""
        return self.estimate.qpos[:3]

    @cached_property
    def world_from_root(self) -> Floats:
        """(4,) unit quaternion of the root."""
        quaternion = self.estimate.qpos[3:7]
        out: Floats = quaternion / np.sqrt(quaternion @ quaternion)
        return out

    @property
    def body(self) -> Body:
        return self.kinematics.body

    @cached_property
    def joints_m(self) -> Floats:
        """(25, 3) positions of the root, then of each bone's far end [m]."""
        start_m, world_from_bone = self.bones
        ends_m = start_m + rotations.rotate(world_from_bone, self.body.skeleton.bone_m)
        return np.concatenate([self.root_m[None], ends_m])


class Output(Protocol):
    """A receiver of poses. Neither `send` nor `close` may wait for the other side."""

    @property
    def name(self) -> str:
        """The option and argument by which the user asked for it."""
        ...

    @property
    def description(self) -> str:
        """One line for the user about where the poses go."""
        ...

    def send(self, pose: LivePose) -> None:
        """Send a pose. Any error ends this output only; the session continues."""
        ...

    def close(self) -> None:
        """Finish the output; may be called repeatedly, and after an error."""
        ...
