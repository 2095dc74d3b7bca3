"""What the trackers would have read had they been worn in the examples."""

from harness.body import kinematics
from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import Take


def station_poses(body: Body, take: Take, worn: Calibration) -> tuple[Floats, Floats]:
    """Positions (T, S, 3) [m] of the stations, and orientations (T, S, 4) of the bones that carry them."""
    start_m, turned = kinematics.bone_poses(body.skeleton, take.qpos)
    bones = [body.skeleton.index(bone) for bone in worn.bones]
    return start_m[:, bones] + rotations.rotate(turned[:, bones], worn.mount_m), turned[:, bones]
