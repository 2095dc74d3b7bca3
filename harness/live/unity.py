"""A pose as Unity's humanoid has it: bones of its HumanBodyBones, local in their parents, no turn in the T-pose.

Unity's axes are left-handed: x right, y up, z forward. VRM avatars, and so the VMC protocol, have every rotation none
in the T-pose. See docs/device.md for the table of bones.
"""

import numpy as np

from harness.body import humanoid
from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Floats, Ints
from harness.core.skeleton import Skeleton
from harness.live.pose import LivePose

HIPS = "Hips"
"""Unity's root bone: the humanoid's root."""
UNITY_BONES: dict[str, tuple[str, str]] = {
    "Spine": ("lowerback", HIPS),
    "Chest": ("upperback", "Spine"),
    "UpperChest": ("thorax", "Chest"),
    "Neck": ("lowerneck", "UpperChest"),
    "Head": ("head", "Neck"),
    **{
        f"{side}{bone}": (f"{letter}{ours}", parent if parent in ("UpperChest", HIPS) else f"{side}{parent}")
        for side, letter in (("Left", "l"), ("Right", "r"))
        for bone, ours, parent in (
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
"""Name in Unity's HumanBodyBones -> our bone that turns with it, and its parent in Unity. Ours that are missing: what
upperneck and the wrists turn is in Head and Hand, and the hip joints do not turn."""


def unity_vector(v: Floats) -> Floats:
    """Ours (..., 3), x forward, y left, z up, in Unity's axes: x right, y up, z forward."""
    return np.stack([-v[..., 1], v[..., 2], v[..., 0]], axis=-1)


def unity_quaternion(q: Floats) -> Floats:
    """Ours (..., 4), w first, in Unity's axes and order x, y, z, w; the mirrored axes turn the other way round."""
    return np.stack([q[..., 2], -q[..., 3], -q[..., 1], q[..., 0]], axis=-1)


class UnityPose:
    """Local positions and rotations of Unity's bones for a body, one pose at a time."""

    def __init__(self, own: Skeleton) -> None:
        self.names = (HIPS, *UNITY_BONES)
        rest = skeleton.forward_kinematics(own, *(part[None] for part in humanoid24.unpack(humanoid.tpose(own))))
        ours = [own.index(bone) for bone, _ in UNITY_BONES.values()]
        self._ours = np.array(ours, dtype=np.int64)
        self._parents: Ints = np.array([self.names.index(p) for _, p in UNITY_BONES.values()], dtype=np.int64)
        self._bone_from_tpose = rotations.from_matrix(np.swapaxes(rest.world_from_bone[0, ours], -1, -2))

    def local(self, pose: LivePose) -> Floats:
        """(21, 7) position x, y, z [m] and quaternion x, y, z, w of each bone in its parent, in Unity's axes."""
        start_m, world_from_bone = pose.bones
        turned = rotations.multiply(world_from_bone[self._ours], self._bone_from_tpose)
        turned = np.concatenate([pose.world_from_root[None], turned])
        at_m = np.concatenate([pose.root_m[None], start_m[self._ours]])
        above = rotations.inverse(turned[self._parents])
        offset_m = rotations.rotate(above, at_m[1:] - at_m[self._parents])
        out = np.empty((len(at_m), 7))
        out[:, :3] = unity_vector(np.concatenate([at_m[:1], offset_m]))
        out[:, 3:] = unity_quaternion(np.concatenate([turned[:1], rotations.multiply(above, turned[1:])]))
        return out
