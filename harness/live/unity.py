"""Conversion of a pose to Unity's humanoid: local poses of its HumanBodyBones.

Unity's axes are left-handed: x right, y up, z forward. In VRM avatars, and so in the VMC protocol, every rotation is
the identity in the T-pose, and bones keep their distances. docs/device.md has the table of bones.
"""

import numpy as np

from harness.body import humanoid
from harness.core import humanoid24, rotations
from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.live.pose import LivePose

HIPS = "Hips"
"""Unity's root bone, which is the root of the model."""
UNITY_BONES: dict[str, tuple[str, str]] = {
    "Spine": ("lowerback", HIPS),
    "Chest": ("upperback", "Spine"),
    "UpperChest": ("thorax", "Chest"),
    "Neck": ("lowerneck", "UpperChest"),
    "Head": ("head", "Neck"),
    **{
        f"{side}{bone}": (f"{letter}{model_bone}", parent if parent in ("UpperChest", HIPS) else f"{side}{parent}")
        for side, letter in (("Left", "l"), ("Right", "r"))
        for bone, model_bone, parent in (
            ("Shoulder", "clavicle", "UpperChest"),
            ("UpperArm", "humerus", "Shoulder"),
            ("LowerArm", "radius", "UpperArm"),
            ("Hand", "hand", "LowerArm"),
            ("UpperLeg", "femur", HIPS),
            ("LowerLeg", "tibia", "UpperLeg"),
            ("Foot", "foot", "LowerLeg"),
        )
    },
}
"""Bone of the model with the same rotation, and parent in Unity, by the name in Unity's HumanBodyBones.

The rotations of the wrist bones are part of Hand, and the hip joints do not rotate. Unity has one bone for lowerneck
and upperneck: `Neck` turns as both do on average, and points at the joint of the head.
"""


def unity_vector(v: Floats) -> Floats:
    """Vectors (..., 3) in world axes (x forward, y left, z up) in Unity's axes (x right, y up, z forward)."""
    return np.stack([-v[..., 1], v[..., 2], v[..., 0]], axis=-1)


def unity_quaternion(q: Floats) -> Floats:
    """Quaternions (..., 4), w first, in Unity's axes and order x, y, z, w; mirrored axes invert rotations."""
    return np.stack([q[..., 2], -q[..., 3], -q[..., 1], q[..., 0]], axis=-1)


class UnityPose:
    """Local positions and rotations of Unity's bones for one body."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.names = (HIPS, *UNITY_BONES)
        rest = forward_kinematics(skeleton, *(part[None] for part in humanoid24.unpack(humanoid.tpose(skeleton))))
        bones = [skeleton.index(bone) for bone, _ in UNITY_BONES.values()]
        start_m = np.concatenate([rest.start_m[0, :1], rest.start_m[0, bones]])
        self._neck, self._head = self.names.index("Neck"), self.names.index("Head")
        self._upper_neck = skeleton.index("upperneck")
        self._bones = np.array(bones, dtype=np.int64)
        self._parents: Ints = np.array([self.names.index(p) for _, p in UNITY_BONES.values()], dtype=np.int64)
        tpose = rotations.from_matrix(np.swapaxes(rest.world_from_bone[0], -1, -2))
        self._bone_from_tpose, self._upper_neck_from_tpose = tpose[bones], tpose[self._upper_neck]
        self._offset_m = start_m[1:] - start_m[self._parents]

    def local(self, pose: LivePose) -> Floats:
        """(20, 7) position x, y, z [m] and quaternion x, y, z, w of each bone in its parent, in Unity's axes.

        Only the position of the hips changes. A bent neck is shorter than `Neck`, by 2 mm on average in CMU's clips.
        """
        start_m, world_from_bone = pose.bones
        rotation = rotations.multiply(world_from_bone[self._bones], self._bone_from_tpose)
        rotation = np.concatenate([pose.world_from_root[None], rotation])
        upper = rotations.multiply(world_from_bone[self._upper_neck], self._upper_neck_from_tpose)
        lower_m, head_m = start_m[self._bones[[self._neck - 1, self._head - 1]]]
        rotation[self._neck] = _aim(
            _midway(rotation[self._neck], upper), self._offset_m[self._head - 1], head_m - lower_m
        )
        above = rotations.inverse(rotation[self._parents])
        out = np.empty((len(rotation), 7))
        out[:, :3] = unity_vector(np.concatenate([pose.root_m[None], self._offset_m]))
        out[:, 3:] = unity_quaternion(np.concatenate([rotation[:1], rotations.multiply(above, rotation[1:])]))
        return out


def _midway(p: Floats, q: Floats) -> Floats:
    """The rotation (4,) halfway from one to another."""
    both = p + np.copysign(1.0, p @ q) * q
    out: Floats = both / np.linalg.norm(both)
    return out


def _aim(world_from_bone: Floats, along: Floats, world_along: Floats) -> Floats:
    """The rotation (4,) nearest to one that turns a vector of the bone (3,) into a direction of the world (3,)."""
    now = rotations.rotate(world_from_bone, along)
    turn = np.append(np.linalg.norm(now) * np.linalg.norm(world_along) + now @ world_along, np.cross(now, world_along))
    size = np.linalg.norm(turn)
    if size < 1e-9:  # the directions are opposite, or there is none
        return world_from_bone
    return rotations.multiply(turn / size, world_from_bone)
