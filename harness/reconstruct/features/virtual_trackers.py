"""What the trackers would have read had they been worn in the examples."""

import numpy as np

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.reconstruct.solver.kinematic_tree import build_tree, forward_kinematics_batch, new_state


def station_poses(body: Body, take: BodyMotion, worn: Calibration) -> tuple[Floats, Floats]:
    """Positions (T, S, 3) [m] of the stations, and orientations (T, S, 4) of the bones that carry them.

    Signs of the quaternions are continuous in time.
    """
    at_m, turned = VirtualTrackers(body, worn).station_poses(take.qpos)
    return at_m, rotations.continuous(turned)


class VirtualTrackers:
    """Trackers on a body."""

    def __init__(self, body: Body, worn: Calibration) -> None:
        self._chain = build_tree(body, [body.skeleton.index(bone) for bone in worn.bones], worn.mount_m)
        self._placed = new_state(self._chain)

    def station_poses(self, qpos: Floats) -> tuple[Floats, Floats]:
        """Positions (T, S, 3) [m] and bone orientations (T, S, 4) for configurations (T, 55)."""
        count = len(self._chain.station_body)
        at_m, turned = np.empty((len(qpos), count, 3)), np.empty((len(qpos), count, 4))
        forward_kinematics_batch(self._chain, self._placed, np.array(qpos, dtype=float), at_m, turned)
        return at_m, turned
