"""Truth and estimate as posed skeletons: the input of every metric.

The joint-centre set has 25 points: the root, then the far end of each of the 24 bones, in the skeleton's order.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.humanoid24 import unpack
from harness.core.skeleton import Skeleton, forward_kinematics


@dataclass(frozen=True, eq=False)
class PoseSequence:
    """T frames of one motion: hinge angles, root, joint centres and bone rotations."""

    skeleton: Skeleton
    angles_rad: Floats
    """(T, D) hinge angles in the skeleton's order."""
    root_m: Floats
    """(T, 3) root position."""
    world_from_root: Floats
    """(T, 4) unit quaternion of the root."""
    joints_m: Floats
    """(T, B + 1, 3) joint centres: the root, then each bone's far end."""
    world_from_bone: Floats
    """(T, B, 3, 3) rotation matrices of the bones."""

    def at(self, rows: Bools | Ints) -> "PoseSequence":
        """Select frames."""
        columns = (self.angles_rad, self.root_m, self.world_from_root, self.joints_m, self.world_from_bone)
        return PoseSequence(self.skeleton, *(column[rows] for column in columns))

    @cached_property
    def root_from_bone(self) -> Floats:
        """(T, B, 3, 3) bone rotations relative to the root."""
        root_from_world = np.swapaxes(rotations.to_matrix(self.world_from_root), -1, -2)
        out: Floats = root_from_world[:, None] @ self.world_from_bone
        return out

    @cached_property
    def parent_from_bone(self) -> Floats:
        """(T, B, 3, 3) bone rotations relative to the parent bone; relative to the root where that is the parent."""
        out = np.array(self.root_from_bone)
        for bone, parent in enumerate(self.skeleton.parents):
            if parent >= 0:
                out[:, bone] = np.swapaxes(self.root_from_bone[:, parent], -1, -2) @ self.root_from_bone[:, bone]
        return out


def compute_poses(skeleton: Skeleton, qpos: Floats) -> PoseSequence:
    """Pose a skeleton with configurations (T, 55); root quaternions are normalised."""
    root_m, quaternion, angles_rad = unpack(np.asarray(qpos, dtype=float))
    world_from_root = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    pose = forward_kinematics(skeleton, root_m, world_from_root, angles_rad)
    joints_m = np.concatenate([root_m[:, None], pose.end_m], axis=1)
    return PoseSequence(skeleton, angles_rad, root_m, world_from_root, joints_m, pose.world_from_bone)


def joint_names(skeleton: Skeleton) -> tuple[str, ...]:
    """(B + 1,) names of the joint-centre set; a bone's name stands for its far end."""
    return ("root", *skeleton.names)


def hinged_bones(skeleton: Skeleton) -> Ints:
    """Indices of the bones with hinges: 22 of 24, all but the hip joints."""
    return np.array([b for b, channels in enumerate(skeleton.hinges) if channels], dtype=np.int64)


def bones_named(skeleton: Skeleton, names: Sequence[str]) -> Ints:
    """Indices of bones; adding 1 gives the index of the far end among the joint centres."""
    return np.array([skeleton.index(name) for name in names], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Pair:
    """F frames with truth and estimate, each posed on its own skeleton.

    The skeletons have the same bones and hinges. Their lengths differ where bone lengths were calibrated.
    """

    truth: PoseSequence
    estimate: PoseSequence
    frame_index: Ints
    """(F,) index of the true frame of each row, strictly increasing; a step of more than one is a gap."""
    rate_hz: float
    ground_m: float = 0.0
    """Ground height under the true feet, see `contact.ground_m` [m]."""

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of the truth."""
        return self.truth.skeleton

    def at(self, rows: Bools) -> "Pair":
        """Select frames."""
        return Pair(self.truth.at(rows), self.estimate.at(rows), self.frame_index[rows], self.rate_hz, self.ground_m)

    def unbroken(self, steps: int) -> Bools:
        """(F,) True where there is no gap between the frame and the `steps` frames before it."""
        out = np.zeros(len(self.frame_index), dtype=bool)
        out[steps:] = self.frame_index[steps:] - self.frame_index[: len(out) - steps] == steps
        return out

    def over_gaps(self, values: Floats, steps: int) -> Floats:
        """(F,) values of n-th differences (F - steps,), with NaN at the first frames and across gaps."""
        out = np.full(len(self.frame_index), np.nan)
        out[steps:] = values
        out[~self.unbroken(steps)] = np.nan
        return out
