"""Virtual trackers: the readings that trackers with given mounts would have had in the examples."""

import numpy as np

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.reconstruct.solver.kinematic_tree import build_tree, forward_kinematics_batch, new_state


def station_poses(body: Body, take: BodyMotion, calibration: Calibration) -> tuple[Floats, Floats]:
    """Station positions (T, S, 3) [m] and orientations of their bones (T, S, 4), for a body motion.

    The quaternions' signs are continuous in time.
    """
    at_m, turned = VirtualTrackers(body, calibration).station_poses(take.qpos)
    return at_m, rotations.continuous(turned)


class VirtualTrackers:
    """Stations of a calibration on a body."""

    def __init__(self, body: Body, calibration: Calibration) -> None:
        bones = [body.skeleton.index(bone) for bone in calibration.bones]
        self._chain = build_tree(body, bones, calibration.mount_m)
        self._placed = new_state(self._chain)

    def station_poses(self, qpos: Floats) -> tuple[Floats, Floats]:
        """Positions (T, S, 3) [m] and bone orientations (T, S, 4) for configurations (T, 55)."""
        count = len(self._chain.station_body)
        at_m, turned = np.empty((len(qpos), count, 3)), np.empty((len(qpos), count, 4))
        forward_kinematics_batch(self._chain, self._placed, np.array(qpos, dtype=float), at_m, turned)
        return at_m, turned
