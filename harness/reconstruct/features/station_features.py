"""Station features: readings as vectors by which examples are compared, relative to the last pose's ground frame.

Columns: for each of S stations the position (3) [m], then two axes of its bone times a lever (6) [m]; 9 S in all.
"""

import numpy as np

from harness.body.humanoid import Body
from harness.body.kinematics import Kinematics
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Singles
from harness.core.calibration import Calibration
from harness.reconstruct.database import Windows
from harness.reconstruct.features.ground_step import features_from_readings
from harness.reconstruct.features.virtual_trackers import VirtualTrackers

_CHUNK = 2048
"""Number of frames whose kinematics are computed at a time."""


class StationFeatures:
    """Features of the frame after each of W windows of a database, for the mounts of a calibration."""

    def __init__(self, body: Body, followed: Windows, calibration: Calibration, lever_m: float) -> None:
        self._lever_m, self._mount_m = lever_m, calibration.mount_m
        self._bones = [body.skeleton.index(bone) for bone in calibration.bones]
        self._identity = np.tile(rotations.IDENTITY, (len(self._bones), 1))
        self.values: Singles = np.empty((len(followed), 9 * len(self._bones)), np.float32)
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

    def station_poses(self, body: Kinematics, qpos: Floats) -> tuple[Floats, Floats]:
        """Station positions (S, 3) [m] and bone orientations (S, 4) of a configuration (55,)."""
        body.set(qpos)
        return body.station_poses(self._bones, self._mount_m, self._identity)
