"""Virtual trackers: the readings that trackers with given mounts would have had in the examples.

Station features are such readings as vectors by which examples are compared, relative to the last pose's ground frame.
Columns: for each of S stations the position (3) [m], then two axes of its bone times a lever (6) [m]; 9 S in all.
"""

import numpy as np

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Singles
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.reconstruct.database.frames import Windows
from harness.reconstruct.solver.ground_frame import features_from_readings
from harness.reconstruct.solver.kinematic_tree import build_tree, forward_kinematics_batch, new_state

_CHUNK = 2048
"""Number of frames whose kinematics are computed at a time."""


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
        self._tree = build_tree(body, bones, calibration.mount_m)
        self._state = new_state(self._tree)

    def station_poses(self, qpos: Floats) -> tuple[Floats, Floats]:
        """Positions (T, S, 3) [m] and bone orientations (T, S, 4) for configurations (T, 55)."""
        count = len(self._tree.station_body)
        at_m, turned = np.empty((len(qpos), count, 3)), np.empty((len(qpos), count, 4))
        forward_kinematics_batch(self._tree, self._state, np.array(qpos, dtype=float), at_m, turned)
        return at_m, turned


class StationFeatures:
    """Features of the frame after each of W windows of a database, for the mounts of a calibration."""

    def __init__(self, body: Body, followed: Windows, calibration: Calibration, lever_m: float) -> None:
        self._lever_m, stations = lever_m, len(calibration.stations)
        self.values: Singles = np.empty((len(followed), 9 * stations), np.float32)
        """(W, 9 S) features [m]."""
        database, trackers = followed.database, VirtualTrackers(body, calibration)
        for start in range(0, len(followed), _CHUNK):
            after = followed.frames[start : start + _CHUNK] + 1
            qpos = database.qpos(after, database.step[after].astype(float))
            at_m, turned = trackers.station_poses(qpos)
            axes = lever_m * rotations.to_matrix(turned)[..., :2]
            columns = np.concatenate([at_m, axes.reshape(*at_m.shape[:2], 6)], axis=2)
            self.values[start : start + _CHUNK] = columns.reshape(len(after), -1)
        database.release_memory()

    def query(self, position_m: Floats, turned: Floats, ground: Floats) -> Singles:
        """(9 S,) features of positions (S, 3) and bone orientations (S, 4) in the world, for a ground frame (3,)."""
        out: Singles = features_from_readings(position_m, turned, ground, self._lever_m)
        return out

    def columns(self, measured: Bools) -> Singles:
        """(9 S,) weights: 1 for columns whose reading (2 S,) of positions, then orientations, was measured, else 0."""
        places, axes = np.split(measured.astype(np.float32), 2)
        return np.concatenate([np.repeat(places, 3).reshape(-1, 3), np.repeat(axes, 6).reshape(-1, 6)], 1).reshape(-1)
