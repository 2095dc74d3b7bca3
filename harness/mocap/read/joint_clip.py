"""Motion as free rotations of joints (BVH, MVNX, AMASS), and its fit to the hinges of the 24-bone skeleton.

A joint rotates everything below it; in the rest pose every joint's frame is parallel to the world. The fit goes from
the root outwards. Each bone gets the hinge angles that bring its world orientation closest to that of the joint that
it is mapped to (`core.skeleton`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.core.skeleton import Skeleton, hinge_angles, hinge_rotation, unwrap_angles
from harness.errors import BadInput

LEG_BONES = ("lfemur", "ltibia", "rfemur", "rtibia")


@dataclass(frozen=True, eq=False)
class JointClip:
    """T frames of J joints, parents before children; world axes x forward, y left, z up."""

    name: str
    subject: str
    source: str
    behaviour: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    """(J,) -1 is the world."""
    offset_m: Floats
    """(J, 3) offset from the parent joint in the rest pose [m]."""
    rate_hz: float
    root_m: Floats
    """(T, 3) position of the first joint [m]."""
    parent_from_joint: Floats
    """(T, J, 4) unit quaternions (w, x, y, z)."""
    unit_m: float = 1.0
    """Length of 1 in the file [m]."""
    unit_evidence: str = "metres"
    """Evidence for the unit."""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        joints = len(self.names)
        freeze(self, offset_m=(joints, 3), root_m=("T", 3), parent_from_joint=("T", joints, 4))

    def __len__(self) -> int:
        return len(self.root_m)

    def cut(self, start: int, stop: int | None = None) -> "JointClip":
        """The clip with the frames from `start` to `stop` (excluded) only."""
        frames = slice(start, stop)
        return replace(self, root_m=self.root_m[frames], parent_from_joint=self.parent_from_joint[frames])

    def world(self) -> tuple[Floats, Floats]:
        """Positions (T, J, 3) [m] and orientations (T, J, 4) of all joints in the world."""
        world_from_joint = np.array(self.parent_from_joint)
        position_m = np.empty((len(self), len(self.names), 3))
        for j, parent in enumerate(self.parents):
            if parent < 0:
                position_m[:, j] = self.root_m
            else:
                above = world_from_joint[:, parent]
                world_from_joint[:, j] = rotations.multiply(above, world_from_joint[:, j])
                position_m[:, j] = position_m[:, parent] + rotations.rotate(above, self.offset_m[j])
        return position_m, world_from_joint

    def rest_m(self) -> Floats:
        """(J, 3) joint positions in the rest pose, with the first joint at the origin [m]."""
        out: Floats = rest_positions(self.parents, self.offset_m) - self.offset_m[0]
        return out


def rest_positions(parents: Sequence[int], offsets: Floats) -> Floats:
    """(J, 3) positions of joints from their offsets (J, 3) from the joints above; those of a first one are its own."""
    positions = np.array(offsets)
    for joint, parent in enumerate(parents):
        if parent >= 0:
            positions[joint] += positions[parent]
    return positions


@dataclass(frozen=True)
class BoneMapping:
    """The joint that a bone of the 24 follows, and the joint at the bone's far end."""

    joint: str
    tip: str | None = None
    """Joint at the bone's far end; None where the file does not have the bone's length."""
    joint_from_bone: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Bone's frame in the joint's frame in the rest pose, where the file's rest pose differs from the skeleton's."""
    start: str | None = None
    """Joint at the bone's near end, and for "root" the joint at its place; None for the joint above `tip`, and for the
    first joint."""

    def with_rest_pose(self, joint_from_bone: tuple[float, float, float, float] | None) -> "BoneMapping":
        """The mapping with another `joint_from_bone`; unchanged for None."""
        return self if joint_from_bone is None else replace(self, joint_from_bone=joint_from_bone)


def _axis_quaternion(axis: int, angle_deg: float) -> tuple[float, float, float, float]:
    w, x, y, z = rotations.exp(np.deg2rad(angle_deg) * np.eye(3)[axis])
    return float(w), float(x), float(y), float(z)


FROM_T_POSE: Mapping[str, tuple[float, float, float, float]] = {
    **{f"{s}{bone}": _axis_quaternion(1, 30.0) for s in "lr" for bone in ("humerus", "radius")},
    **{f"l{bone}": _axis_quaternion(0, -20.0) for bone in ("femur", "tibia", "foot")},
    **{f"r{bone}": _axis_quaternion(0, 20.0) for bone in ("femur", "tibia", "foot")},
}
"""`joint_from_bone` for files whose rest pose is a T with straight legs, and whose elbows then bend about the vertical.

In the skeleton's rest pose the legs are 20 deg abducted and the elbows' axes rotated by 30 deg.
"""

JointMap = Mapping[str, BoneMapping]
"""The mapping of each of the 24 bones, and of "root"."""


def to_clip(joint_clip: JointClip, joint_map: JointMap) -> Clip:
    """The motion on the 24 bones, with the residual of the fit in its notes; see `fit_hinges`."""
    clip, residual_rad = fit_hinges(joint_clip, joint_map)
    mean_deg = np.rad2deg(residual_rad.mean(axis=0))
    worst = int(np.argmax(mean_deg))
    note = f"hinges fitted to joint rotations: mean residual {mean_deg.mean():.2f} deg, "
    note += f"largest at {clip.skeleton.names[worst]} ({mean_deg[worst]:.2f} deg)"
    return replace(clip, notes=(*clip.notes, note))


def fit_hinges(joint_clip: JointClip, joint_map: JointMap) -> tuple[Clip, Floats]:
    """Fit unwrapped hinge angles to the joints' rotations; BadInput if the map and the joints do not agree.

    Beside the clip, (T, 24) angles between the target and the fitted world orientation of each bone [rad]. A bone whose
    length is missing or zero in the file gets that of the mean skeleton, scaled by the legs; the notes name it.
    """
    skeleton, notes = _build_skeleton(joint_clip, joint_map)
    position_m, world_from_joint = joint_clip.world()
    place = joint_map["root"].start
    root_m = joint_clip.root_m if place is None else position_m[:, joint_clip.names.index(place)]
    targets = {bone: _target_orientation(joint_clip, world_from_joint, to) for bone, to in joint_map.items()}
    fitted: dict[int, Floats] = {-1: targets["root"]}
    angles = np.zeros((len(joint_clip), len(skeleton.axes)))
    residual = np.empty((len(joint_clip), skeleton.bone_count))
    for b, parent in enumerate(skeleton.parents):
        axes = skeleton.axes[skeleton.dof_of_bone[b]]
        target = targets[skeleton.names[b]]
        angles_rad = hinge_angles(axes, rotations.multiply(rotations.inverse(fitted[parent]), target))
        angles[:, skeleton.dof_of_bone[b]] = angles_rad
        fitted[b] = rotations.multiply(fitted[parent], hinge_rotation(axes, angles_rad))
        residual[:, b] = rotations.angle_between_rad(fitted[b], target)
    clip = Clip(
        name=joint_clip.name,
        subject=joint_clip.subject,
        source=joint_clip.source,
        behaviour=joint_clip.behaviour,
        skeleton=skeleton,
        rate_hz=joint_clip.rate_hz,
        root_m=root_m,
        world_from_root=rotations.continuous(targets["root"]),
        angles_rad=unwrap_angles(skeleton, angles),
        notes=(*joint_clip.notes, *notes),
    )
    return clip, residual


def _target_orientation(joint_clip: JointClip, world_from_joint: Floats, mapping: BoneMapping) -> Floats:
    """World orientation (T, 4) of a bone that follows its joint exactly."""
    joint = joint_clip.names.index(mapping.joint)
    return rotations.multiply(world_from_joint[:, joint], np.array(mapping.joint_from_bone))


def _build_skeleton(joint_clip: JointClip, joint_map: JointMap) -> tuple[Skeleton, list[str]]:
    """The 24 bones with the file's lengths, and notes about lengths that were filled in."""
    _check_map(joint_clip, joint_map)
    mean = standard_skeleton()
    bone_m, rest_m = np.zeros((mean.bone_count, 3)), joint_clip.rest_m()
    for b, bone in enumerate(mean.names):
        mapping = joint_map[bone]
        if mapping.tip is not None:
            tip = joint_clip.names.index(mapping.tip)
            start = joint_clip.parents[tip] if mapping.start is None else joint_clip.names.index(mapping.start)
            offset = rest_m[tip] - rest_m[start]
            bone_m[b] = rotations.rotate(rotations.inverse(np.array(mapping.joint_from_bone)), offset)
    length = np.sqrt(np.sum(bone_m**2, axis=1))
    lacking = length < 1e-6
    legs = [mean.index(bone) for bone in LEG_BONES]
    scale = 1.0 if lacking[legs].any() else float(length[legs].sum() / mean.length_m[legs].sum())
    bone_m[lacking] = mean.bone_m[lacking] * scale
    filled = [bone for bone, lacks in zip(mean.names, lacking, strict=True) if lacks]
    if len(filled) == mean.bone_count:
        return mean, ["the file has no bone lengths: the motion is on the mean skeleton"]
    notes = [f"the file leaves out the length of {', '.join(filled)}: that of the mean skeleton, scaled by the legs"]
    return mean.with_bones(bone_m), notes if filled else []


def _check_map(joint_clip: JointClip, joint_map: JointMap) -> None:
    absent = [bone for bone in ("root", *standard_skeleton().names) if bone not in joint_map]
    if absent:
        raise BadInput(f"The joint map lacks {', '.join(absent)}.", "Map every bone of the 24, and root.")
    for bone, mapping in joint_map.items():
        for joint in (mapping.joint, mapping.tip, mapping.start):
            if joint is not None and joint not in joint_clip.names:
                have = ", ".join(joint_clip.names)
                raise BadInput(f"{joint_clip.name}: there is no joint {joint} for {bone}.", f"Its joints are {have}.")
