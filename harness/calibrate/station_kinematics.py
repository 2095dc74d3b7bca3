"""Where stations are in several poses of one body at once, and how that changes with everything that calibration
seeks: bones, mounts, roots and hinges; in plain numpy.

A station's place is linear in bone vectors and in its mount; hinges and roots turn what lies beyond them. Turns of
stations are given as small turns in world axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class StationPoses:
    """P poses of S stations, B bones and D hinges."""

    place_m: Floats
    """(P, S, 3) of stations in the world."""
    world_from_station: Floats
    """(P, S, 3, 3)"""
    world_from_bone: Floats
    """(P, B, 3, 3)"""
    joint_m: Floats
    """(P, B, 3) the joint that each bone turns about."""
    hinge_axis: Floats
    """(P, D, 3) in the world."""
    root_m: Floats
    """(P, 3)"""


class StationKinematics:
    """The bones between the root and stations on these bones (S,)."""

    def __init__(self, skeleton: Skeleton, bones: Sequence[int] | Ints) -> None:
        self.skeleton, self.bones = skeleton, np.asarray(bones, dtype=np.int64)
        count = skeleton.bone_count
        above = np.zeros((count, count), dtype=bool)
        for bone, parent in enumerate(skeleton.parents):
            if parent >= 0:
                above[bone] = above[parent]
                above[bone, parent] = True
        self._hinge_bone: Ints = np.repeat(np.arange(count), [len(h) for h in skeleton.hinges])
        self.bone_moves_station: Bools = above[self.bones]
        """(S, B) whether the whole of a bone lies between the root and the station."""
        self.hinge_turns_station: Bools = (above | np.eye(count, dtype=bool))[self.bones][:, self._hinge_bone]
        """(S, D) whether a hinge turns the station."""
        self._cross: Floats = np.cross(np.eye(3), skeleton.axes[:, None])
        """(D, 3, 3) matrices of the cross product with each axis."""
        self._square: Floats = self._cross @ self._cross

    def forward_kinematics(
        self,
        bone_m: Floats,
        root_m: Floats,
        world_from_root: Floats,
        angles_rad: Floats,
        mount_m: Floats,
        bone_from_station: Floats,
    ) -> StationPoses:
        """Of bone vectors (B, 3), roots (P, 3) and (P, 3, 3), hinges (P, D), mounts (S, 3) and (S, 3, 3)."""
        poses, skeleton = len(root_m), self.skeleton
        sine, cosine = np.sin(angles_rad)[:, :, None, None], np.cos(angles_rad)[:, :, None, None]
        hinge = np.eye(3) + sine * self._cross + (1.0 - cosine) * self._square
        turned, joint = np.empty((poses, skeleton.bone_count, 3, 3)), np.empty((poses, skeleton.bone_count, 3))
        axis = np.empty((poses, len(skeleton.axes), 3))
        for bone, parent in enumerate(skeleton.parents):
            turn = world_from_root if parent < 0 else turned[:, parent]
            joint[:, bone] = root_m if parent < 0 else joint[:, parent] + turned[:, parent] @ bone_m[parent]
            where = skeleton.dof_of_bone[bone]
            for dof in range(where.stop - 1, where.start - 1, -1):
                axis[:, dof] = turn @ skeleton.axes[dof]
                turn = turn @ hinge[:, dof]
            turned[:, bone] = turn
        carried = turned[:, self.bones]
        place = joint[:, self.bones] + (carried @ mount_m[:, :, None])[..., 0]
        return StationPoses(place, carried @ bone_from_station, turned, joint, axis, root_m)

    def bone_jacobian(self, at: StationPoses, bones: Ints, vectors: Floats) -> Floats:
        """(P, S, 3, G) how places change with what is added to these bones (G,) along these vectors (G, 3); turns of
        stations do not."""
        along = (at.world_from_bone[:, bones] @ vectors[:, :, None])[:, None, :, :, 0]
        return np.swapaxes(along * self.bone_moves_station[:, bones, None], -1, -2)

    def mount_jacobian(self, at: StationPoses) -> Floats:
        """(P, S, 3, 3) how places change with the station's own mount."""
        out: Floats = at.world_from_bone[:, self.bones]
        return out

    def root_jacobian(self, at: StationPoses) -> tuple[Floats, Floats]:
        """(P, S, 3, 6) how places and turns change with shifts and small turns of the root in world axes."""
        place, turn = np.zeros((2, *at.place_m.shape, 6))
        place[..., :3] = turn[..., 3:] = np.eye(3)
        reach_m = at.place_m - at.root_m[:, None]
        place[..., 3:] = np.swapaxes(np.cross(np.eye(3), reach_m[..., None, :]), -1, -2)
        return place, turn

    def hinge_jacobian(self, at: StationPoses) -> tuple[Floats, Floats]:
        """(P, S, 3, D) how places and turns change with hinge angles."""
        reach_m = at.place_m[:, :, None] - at.joint_m[:, None, self._hinge_bone]
        turn = at.hinge_axis[:, None] * self.hinge_turns_station[:, :, None]
        place = np.cross(turn, reach_m)
        return np.swapaxes(place, -1, -2), np.swapaxes(turn, -1, -2)
