"""What outputs are given: one estimate, posed, with all that is known of when."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from harness.body.humanoid import Body
from harness.body.kinematics import Kinematics
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Estimate
from harness.stream.frame import TrackerFrame


@dataclass(frozen=True, eq=False)
class LivePose:
    """A pose at the moment it is ready."""

    number: int
    """From 0; what the queue dropped has none."""
    frame: TrackerFrame
    taken_s: float
    """Host monotonic clock when the frame was taken from the queue [s]."""
    ready_s: float
    """The same when the pose was ready."""
    measured_s: float
    """The same at the measurement, as far as stamps tell (`clock.HostTime`)."""
    estimate: Estimate
    kinematics: Kinematics
    """Shared by all poses of a session and set to this one when first needed; one thread."""

    @cached_property
    def bones(self) -> tuple[Floats, Floats]:
        """Joints (24, 3) [m] and `world_from_bone` (24, 4)."""
        self.kinematics.set(self.estimate.qpos)
        return self.kinematics.bone_poses()

    @property
    def device_s(self) -> float:
        """The mean of the stations' stamps by the device's clock [s]; the host's when there are none."""
        known = self.frame.measured_s[~np.isnan(self.frame.measured_s)]
        return float(known.mean()) if len(known) else self.frame.received_s

    @property
    def root_m(self) -> Floats:
        """(3,)"""
        return self.estimate.qpos[:3]

    @cached_property
    def world_from_root(self) -> Floats:
        """(4,) unit quaternion."""
        quaternion = self.estimate.qpos[3:7]
        out: Floats = quaternion / np.sqrt(quaternion @ quaternion)
        return out

    @property
    def body(self) -> Body:
        return self.kinematics.body

    @cached_property
    def joints_m(self) -> Floats:
        """(25, 3) the root, then each bone's far end [m]."""
        start_m, world_from_bone = self.bones
        ends_m = start_m + rotations.rotate(world_from_bone, self.body.skeleton.bone_m)
        return np.concatenate([self.root_m[None], ends_m])


class Output(Protocol):
    """Somewhere poses go. Neither call may wait for whoever listens."""

    @property
    def name(self) -> str:
        """As the user asked for it."""
        ...

    @property
    def description(self) -> str:
        """Where it goes, in a line for the user."""
        ...

    def send(self, pose: LivePose) -> None:
        """OSError, or what a library raises, when it cannot: the session goes on without this output."""
        ...

    def close(self) -> None:
        """Finish what was begun; also after an error, and as often as one likes."""
        ...
