"""The readings of a frame as numbers to compare examples by, seen from the ground frame of the pose before it.

Columns: for each of S stations its place (3) [m], then two axes of its bone times a lever (6) [m]; 9 S in all.
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
"""Frames whose kinematics are worked out at a time."""


class StationFeatures:
    """Of the frame after each window of a database, had the trackers been worn as a calibration says."""

    def __init__(self, body: Body, followed: Windows, worn: Calibration, lever_m: float) -> None:
        self._lever_m, self._mount_m = lever_m, worn.mount_m
        self._bones = [body.skeleton.index(bone) for bone in worn.bones]
        self._no_turn = np.tile(rotations.IDENTITY, (len(self._bones), 1))
        self.values: Singles = np.empty((len(followed), 9 * len(self._bones)), np.float32)
        """(W, 9 S)"""
        database, trackers = followed.database, VirtualTrackers(body, worn)
        for start in range(0, len(followed), _CHUNK):
            after = followed.frames[start : start + _CHUNK] + 1
            qpos = database.qpos(after, database.step[after].astype(float))
            at_m, turned = trackers.station_poses(qpos)
            axes = lever_m * rotations.to_matrix(turned)[..., :2]
            columns = np.concatenate([at_m, axes.reshape(*at_m.shape[:2], 6)], axis=2)
            self.values[start : start + _CHUNK] = columns.reshape(len(after), -1)
        database.release_memory()

    def query(self, position_m: Floats, turned: Floats, ground: Floats) -> Singles:
        """(9 S,) of positions (S, 3) and bone orientations (S, 4) in the world, from a ground frame (3,)."""
        out: Singles = features_from_readings(position_m, turned, ground, self._lever_m)
        return out

    def columns(self, measured: Bools) -> Singles:
        """(9 S,) 1 where rows (2S,) of a frame were measured, else 0."""
        places, axes = np.split(measured.astype(np.float32), 2)
        return np.concatenate([np.repeat(places, 3).reshape(-1, 3), np.repeat(axes, 6).reshape(-1, 6)], 1).reshape(-1)

    def station_poses(self, body: Kinematics, qpos: Floats) -> tuple[Floats, Floats]:
        """Positions (S, 3) and bone orientations (S, 4) at a configuration (55,)."""
        body.set(qpos)
        return body.station_poses(self._bones, self._mount_m, self._no_turn)
