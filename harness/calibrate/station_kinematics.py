"""Forward kinematics of stations in several poses of one body, with Jacobians in bones, mounts, roots and hinges.

Plain numpy. A station's position is linear in bone vectors and in its mount; hinges and roots rotate what lies beyond
them. Rotations of stations are differentiated as small rotation vectors in world axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class StationPoses:
    """Poses of S stations and B bones, with D hinges, in P poses of the body."""

    place_m: Floats
    """(P, S, 3) station positions in the world [m]."""
    world_from_station: Floats
    """(P, S, 3, 3) station orientations."""
    world_from_bone: Floats
    """(P, B, 3, 3) bone orientations."""
    joint_m: Floats
    """(P, B, 3) the joint that each bone rotates about [m]."""
    hinge_axis: Floats
    """(P, D, 3) hinge axes in the world."""
    root_m: Floats
    """(P, 3) root positions [m]."""


class StationKinematics:
    """Kinematics of stations on some bones (S,) of a skeleton."""

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
        """(S, B) whether a whole bone lies between the root and the station."""
        self.hinge_turns_station: Bools = (above | np.eye(count, dtype=bool))[self.bones][:, self._hinge_bone]
        """(S, D) whether a hinge rotates the station."""
        self._cross: Floats = rotations.cross_matrix(skeleton.axes)
        """(D, 3, 3) cross-product matrix of each axis."""
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
        """Station poses for bones (B, 3), roots (P, 3) and (P, 3, 3), hinges (P, D), mounts (S, 3) and (S, 3, 3)."""
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
        """(P, S, 3, G) Jacobian of positions in bone coordinates: bones (G,) along vectors (G, 3).

        Orientations do not depend on them.
        """
        along = (at.world_from_bone[:, bones] @ vectors[:, :, None])[:, None, :, :, 0]
        return np.swapaxes(along * self.bone_moves_station[:, bones, None], -1, -2)

    def mount_jacobian(self, at: StationPoses) -> Floats:
        """(P, S, 3, 3) Jacobian of positions in the station's own mount."""
        out: Floats = at.world_from_bone[:, self.bones]
        return out

    def root_jacobian(self, at: StationPoses) -> tuple[Floats, Floats]:
        """(P, S, 3, 6) Jacobians of positions and of rotations in the root's translation and rotation, world axes."""
        place, turn = np.zeros((2, *at.place_m.shape, 6))
        place[..., :3] = turn[..., 3:] = np.eye(3)
        reach_m = at.place_m - at.root_m[:, None]
        place[..., 3:] = -rotations.cross_matrix(reach_m)
        return place, turn

    def hinge_jacobian(self, at: StationPoses) -> tuple[Floats, Floats]:
        """(P, S, 3, D) Jacobians of positions and of rotations in the hinge angles."""
        reach_m = at.place_m[:, :, None] - at.joint_m[:, None, self._hinge_bone]
        turn = at.hinge_axis[:, None] * self.hinge_turns_station[:, :, None]
        place = np.cross(turn, reach_m)
        return np.swapaxes(place, -1, -2), np.swapaxes(turn, -1, -2)
