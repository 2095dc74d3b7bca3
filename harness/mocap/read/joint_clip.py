"""Motion given as free rotations of joints (BVH, AMASS), and its fit to the hinges of the 24-bone skeleton.

A joint here turns everything below it; in the rest pose every joint's frame is parallel to the world. The fit goes
from the root outwards: each bone gets the hinge angles that bring its orientation in the world nearest to that of the
joint that drives it (`core.hinges`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.hinges import hinge_angles, hinge_rotation
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.motion import Clip
from harness.core.skeleton import Skeleton, unwrap_angles
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
    """(J, 3) from the parent joint, in the rest pose [m]."""
    rate_hz: float
    root_m: Floats
    """(T, 3) position of the first joint [m]."""
    parent_from_joint: Floats
    """(T, J, 4) unit quaternions (w, x, y, z)."""
    unit_m: float = 1.0
    """Length of 1 in the file [m]."""
    unit_evidence: str = "metres"
    """Why the unit is what it is."""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        joints = len(self.names)
        freeze(self, offset_m=(joints, 3), root_m=("T", 3), parent_from_joint=("T", joints, 4))

    def __len__(self) -> int:
        return len(self.root_m)

    def cut(self, start: int, stop: int | None = None) -> "JointClip":
        """Frames from `start` up to `stop`."""
        frames = slice(start, stop)
        return replace(self, root_m=self.root_m[frames], parent_from_joint=self.parent_from_joint[frames])

    def world(self) -> tuple[Floats, Floats]:
        """Positions (T, J, 3) [m] and orientations (T, J, 4) of all joints in the world."""
        turned = np.array(self.parent_from_joint)
        at = np.empty((len(self), len(self.names), 3))
        for j, parent in enumerate(self.parents):
            if parent < 0:
                at[:, j] = self.root_m
            else:
                turned[:, j] = rotations.multiply(turned[:, parent], turned[:, j])
                at[:, j] = at[:, parent] + rotations.rotate(turned[:, parent], self.offset_m[j])
        return at, turned

    def rest_m(self) -> Floats:
        """(J, 3) joint positions in the rest pose, the first joint at the origin [m]."""
        at = np.zeros((len(self.names), 3))
        for j, parent in enumerate(self.parents):
            if parent >= 0:
                at[j] = at[parent] + self.offset_m[j]
        return at


@dataclass(frozen=True)
class BoneMapping:
    """What drives a bone of the 24: a joint, and the joint at the bone's far end."""

    joint: str
    tip: str | None = None
    """Its offset in the rest pose is the bone; None where the file does not know the bone's length."""
    joint_from_bone: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Where the file's rest pose differs from the skeleton's: the bone's frame in the joint's, in rest."""


JointMap = Mapping[str, BoneMapping]
"""Every one of the 24 bones, and "root"."""


@dataclass(frozen=True, eq=False)
class HingeFit:
    """A fitted clip, and what the hinges could not follow."""

    clip: Clip
    residual_rad: Floats
    """(T, 24) angle between each bone's wanted and fitted orientation in the world [rad]."""


def to_clip(joint_clip: JointClip, joint_map: JointMap) -> Clip:
    """The motion on the 24 bones; the residual of the fit is in its notes. See `fit_hinges`."""
    fit = fit_hinges(joint_clip, joint_map)
    mean_deg = np.rad2deg(fit.residual_rad.mean(axis=0))
    worst = int(np.argmax(mean_deg))
    note = f"hinges fitted to joint rotations: mean residual {mean_deg.mean():.2f} deg, "
    note += f"largest at {BONES[worst]} ({mean_deg[worst]:.2f} deg)"
    return replace(fit.clip, notes=(*fit.clip.notes, note))


def fit_hinges(joint_clip: JointClip, joint_map: JointMap) -> HingeFit:
    """The hinge angles nearest to the joints' rotations, unwrapped; BadInput if the map and the joints do not agree.

    A bone of which the file does not know the length (or leaves it out: zero) has that of the mean skeleton, scaled
    by the legs; the notes name it.
    """
    skeleton, notes = _build_skeleton(joint_clip, joint_map)
    _, turned = joint_clip.world()
    wanted = {bone: _target_orientation(joint_clip, turned, drive) for bone, drive in joint_map.items()}
    fitted: dict[int, Floats] = {-1: wanted["root"]}
    angles = np.zeros((len(joint_clip), len(skeleton.axes)))
    residual = np.empty((len(joint_clip), skeleton.bone_count))
    for b, parent in enumerate(skeleton.parents):
        axes = skeleton.axes[skeleton.dof_of_bone[b]]
        target = wanted[skeleton.names[b]]
        turn = hinge_angles(axes, rotations.multiply(rotations.inverse(fitted[parent]), target))
        angles[:, skeleton.dof_of_bone[b]] = turn
        fitted[b] = rotations.multiply(fitted[parent], hinge_rotation(axes, turn))
        residual[:, b] = rotations.angle_between_rad(fitted[b], target)
    clip = Clip(
        name=joint_clip.name,
        subject=joint_clip.subject,
        source=joint_clip.source,
        behaviour=joint_clip.behaviour,
        skeleton=skeleton,
        rate_hz=joint_clip.rate_hz,
        root_m=joint_clip.root_m,
        world_from_root=rotations.continuous(wanted["root"]),
        angles_rad=unwrap_angles(skeleton, angles),
        notes=(*joint_clip.notes, *notes),
    )
    return HingeFit(clip, residual)


def _target_orientation(joint_clip: JointClip, turned: Floats, drive: BoneMapping) -> Floats:
    """World orientation (T, 4) that the joint asks of its bone."""
    joint = joint_clip.names.index(drive.joint)
    return rotations.multiply(turned[:, joint], np.array(drive.joint_from_bone))


def _build_skeleton(joint_clip: JointClip, joint_map: JointMap) -> tuple[Skeleton, list[str]]:
    """The 24 bones with the file's lengths, and what was filled in."""
    _check_map(joint_clip, joint_map)
    mean = standard_skeleton()
    bone_m = np.zeros((mean.bone_count, 3))
    for b, bone in enumerate(mean.names):
        drive = joint_map[bone]
        if drive.tip is not None:
            offset = joint_clip.offset_m[joint_clip.names.index(drive.tip)]
            bone_m[b] = rotations.rotate(rotations.inverse(np.array(drive.joint_from_bone)), offset)
    length = np.sqrt(np.sum(bone_m**2, axis=1))
    lacking = length < 1e-6
    legs = [mean.index(bone) for bone in LEG_BONES]
    scale = 1.0 if lacking[legs].any() else float(length[legs].sum() / mean.length_m[legs].sum())
    bone_m[lacking] = mean.bone_m[lacking] * scale
    filled = [bone for bone, lacks in zip(mean.names, lacking, strict=True) if lacks]
    if len(filled) == mean.bone_count:
        return mean, ["the file knows no bone lengths: played on the mean skeleton"]
    notes = [f"the file leaves out the length of {', '.join(filled)}: that of the mean skeleton, scaled by the legs"]
    return mean.with_bones(bone_m), notes if filled else []


def _check_map(joint_clip: JointClip, joint_map: JointMap) -> None:
    absent = [bone for bone in ("root", *BONES) if bone not in joint_map]
    if absent:
        raise BadInput(f"The joint map says nothing about {', '.join(absent)}.", "Map every bone of the 24, and root.")
    for bone, drive in joint_map.items():
        for joint in (drive.joint, drive.tip):
            if joint is not None and joint not in joint_clip.names:
                have = ", ".join(joint_clip.names)
                raise BadInput(f"{joint_clip.name}: no joint {joint} to drive {bone}.", f"Its joints are {have}.")
