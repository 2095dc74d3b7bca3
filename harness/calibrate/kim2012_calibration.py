"""T-pose calibration by eq. 1 of Kim et al. 2012 as printed: a linear map for each sensor (docs/papers.md B2).

A sensor's position and orientation in the world, p_w and q_w, become those of a character's joint:

    p_v = T_p p_w + b,    q_v = T_q q_w

In T-pose the mapped sensor is where the character's joint is. The map turns a reading in the room; a mount would turn
it on the bone. So the equation finds no mounts, and an orientation is right only if the sensor is strapped on in the
character's orientation. One T-pose gives three equations for the twelve numbers of T_p and b, so T_p is one rotation
for all sensors: the heading that fits their places best. The character's joints are the nominal mounts, which are
nearer to the sensors than the joints of the bones.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.body import Body, Kinematics, Mount, locate_mounts, tpose
from harness.calibrate.held_pose_model import heading_between_rad
from harness.calibrate.hold import measure_hold
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.stream import TrackerFrame


@dataclass(frozen=True, eq=False)
class SensorMaps:
    """Maps of S sensors from the tracker's frame to the character's world: eq. 1."""

    world_from_tracker: Floats
    """(4,) T_p as a unit quaternion, the same for all sensors."""
    offset_m: Floats
    """(S, 3) b [m]."""
    turn: Floats
    """(S, 4) T_q, unit quaternions."""

    def __post_init__(self) -> None:
        freeze(self, world_from_tracker=(4,), offset_m=("S", 3), turn=(len(self.offset_m), 4))

    def apply(self, frame: TrackerFrame) -> TrackerFrame:
        """The frame with each reading mapped; invalid readings stay NaN."""
        return replace(
            frame,
            position_m=rotations.rotate(self.world_from_tracker, frame.position_m) + self.offset_m,
            tracker_from_station=rotations.multiply(self.turn, frame.tracker_from_station),
        )


@dataclass(frozen=True, eq=False)
class Kim2012Calibration:
    """Result of eq. 1: the maps, and the calibration of mapped frames."""

    maps: SensorMaps
    calibration: Calibration
    """Of kind `kim2012`: the character's nominal mounts, and a tracker frame that is the world's."""


def calibrate_kim2012(frames: Sequence[TrackerFrame], body: Body, mounts: Sequence[Mount]) -> Kim2012Calibration:
    """Maps from frames of a performer in T-pose; `mounts` are the character's joints, in the order of the stations.

    UnusableHold says what is wrong with the readings and what to do. BadInput for stations that are not the stream's.
    """
    names, skeleton, kinematics = [mount.station for mount in mounts], body.skeleton, Kinematics(body)
    hold = measure_hold(frames, names)
    bones, mount_m, bone_from_station = locate_mounts(skeleton, mounts)
    kinematics.set(tpose(skeleton))
    joint_m, world_from_joint = kinematics.station_poses(bones, mount_m, bone_from_station)
    level_m = rotations.rotate(LEVEL_FROM_TRACKER, hold.position_m)
    heading = rotations.about_z(heading_between_rad(level_m, joint_m))
    maps = SensorMaps(
        world_from_tracker=rotations.multiply(heading, LEVEL_FROM_TRACKER),
        offset_m=joint_m - rotations.rotate(heading, level_m),
        turn=rotations.multiply(world_from_joint, rotations.inverse(hold.tracker_from_station)),
    )
    calibration = Calibration(
        kind="kim2012",
        stations=tuple(names),
        bones=tuple(mount.bone for mount in mounts),
        mount_m=mount_m,
        bone_from_station=bone_from_station,
        world_from_tracker=rotations.IDENTITY,
        tracker_origin_m=np.zeros(3),
    )
    return Kim2012Calibration(maps, calibration)
