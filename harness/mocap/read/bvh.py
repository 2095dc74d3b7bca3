"""BVH files: checked line by line here, their motion read by upc-pymotion, in world axes and metres.

BVH records no unit of length. The height of the skeleton tells it: in exactly one of the usual units the rest pose is
1.2 to 2.2 m tall. The "MotionBuilder-friendly" conversion of CMU's library has the unit of the ASF files, 1/0.45 inch;
files that `harness.mocap.write.bvh` wrote are in centimetres. Axes are x left, y up, z forward in both; a file whose
rest pose says otherwise is refused. An End Site becomes a joint named after its parent, such as "Head_end".
"""

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.errors import BadFile
from harness.mocap.read.asf import INCH_M, WORLD_FROM_ASF
from harness.mocap.read.bvh_text import BvhText, parse_bvh
from harness.mocap.read.joint_clip import BoneMapping, JointClip, JointMap, rest_positions, to_clip

UNITS_M = {"metres": 1.0, "centimetres": 0.01, "millimetres": 0.001, "inches": INCH_M, "ASF units": INCH_M / 0.45}
HEIGHT_M = (1.2, 2.2)
"""Range of people's heights in the rest pose [m]; no two of the units above fit the same file."""
_EXPORT_UNIT = 0.01, "centimetres, as this package writes"
"""Unit of length [m] of the package's own files, and the evidence for it."""


def _cmu_map() -> dict[str, BoneMapping]:
    mapping = {
        "root": BoneMapping("Hips"),
        "lowerback": BoneMapping("LowerBack", "Spine"),
        "upperback": BoneMapping("Spine", "Spine1"),
        "thorax": BoneMapping("Spine1", "Neck"),
        "lowerneck": BoneMapping("Neck", "Neck1"),
        "upperneck": BoneMapping("Neck1", "Head"),
        "head": BoneMapping("Head", "Head_end"),
    }
    for side, s in (("Left", "l"), ("Right", "r")):
        mapping[f"{s}clavicle"] = BoneMapping(f"{side}Shoulder", f"{side}Arm")
        mapping[f"{s}humerus"] = BoneMapping(f"{side}Arm", f"{side}ForeArm")
        mapping[f"{s}radius"] = BoneMapping(f"{side}ForeArm", f"{side}Hand")
        mapping[f"{s}wrist"] = BoneMapping(f"{side}Hand", f"{side}FingerBase")
        mapping[f"{s}hand"] = BoneMapping(f"{side}FingerBase", f"{side}HandIndex1")
        mapping[f"{s}hipjoint"] = BoneMapping(f"{side[0]}HipJoint", f"{side}UpLeg")
        mapping[f"{s}femur"] = BoneMapping(f"{side}UpLeg", f"{side}Leg")
        mapping[f"{s}tibia"] = BoneMapping(f"{side}Leg", f"{side}Foot")
        mapping[f"{s}foot"] = BoneMapping(f"{side}Foot", f"{side}ToeBase")
    return mapping


CMU_MAP: JointMap = _cmu_map()
"""Joints of the "MotionBuilder-friendly" conversion of CMU's library, which leaves out lengths of thorax and wrists."""


def _export_map() -> dict[str, BoneMapping]:
    skeleton = standard_skeleton()
    mapping = {"root": BoneMapping("root")}
    for bone, name in enumerate(skeleton.names):
        children = [child for child, parent in zip(skeleton.names, skeleton.parents, strict=True) if parent == bone]
        mapping[name] = BoneMapping(name, children[0] if children else f"{name}_end")
    return mapping


EXPORT_MAP: JointMap = _export_map()
"""Joints of the files that `harness.mocap.write.bvh` writes: each is named after the bone that starts there."""


def read_bvh(path: Path | str, *, unit_m: float | None = None) -> JointClip:
    """Read the motion of a BVH file on its own joints, every frame.

    `unit_m` is the length of 1 in the file [m]; without it the joints or the skeleton's height must tell. Raises
    BadFile, with the line, for anything but a tree of joints with one root (6 channels, position first) and rotations
    (3 channels) below it.
    """
    path = Path(path)
    text = parse_bvh(path)
    data = _load_with_pymotion(text)
    rotation, position, *_ = data.get_data()
    turned = np.zeros((len(position), len(text.joints), 4))
    turned[..., 0] = 1.0
    turned[:, [j for j, joint in enumerate(text.joints) if joint.channels]] = _rotate_to_world(rotation)
    offset = np.array([joint.offset for joint in text.joints])
    names = tuple(joint.name for joint in text.joints)
    unit, evidence = _length_unit(path, text, names) if unit_m is None else (unit_m, "as given")
    return JointClip(
        name=path.stem,
        subject=path.stem.split("_", 1)[0],
        source=path.parent.name,
        behaviour="",
        names=names,
        parents=tuple(joint.parent for joint in text.joints),
        offset_m=offset @ WORLD_FROM_ASF.T * unit,
        rate_hz=_rate_hz(text.frame_time_s),
        root_m=position[:, 0] @ WORLD_FROM_ASF.T * unit,
        parent_from_joint=turned,
        unit_m=unit,
        unit_evidence=evidence,
        notes=text.notes,
    )


def read_bvh_clip(path: Path | str, *, unit_m: float | None = None) -> Clip:
    """Read a BVH file as a clip of the 24 bones: one of CMU's conversion, or one that this package wrote.

    The T-pose that CMU's conversion adds in front is left out. Raises BadFile for other joints; see `read_bvh`.
    """
    joint_clip = read_bvh(path, unit_m=unit_m)
    clip = to_humanoid_clip(joint_clip)
    if clip is None:
        advice = "For another skeleton write a joint map and use `harness.mocap.read.joint_clip.to_clip`."
        raise BadFile(path, "other joints", "those of CMU's conversion, Hips to Head, or of this package", advice)
    return clip


def to_humanoid_clip(joint_clip: JointClip) -> Clip | None:
    """The motion on the 24 bones; None unless its joints are those of CMU's conversion or of this package."""
    if _has_joints(joint_clip.names, EXPORT_MAP):
        return to_clip(joint_clip, EXPORT_MAP)
    if not _has_joints(joint_clip.names, CMU_MAP):
        return None
    if starts_in_t_pose(joint_clip):
        joint_clip = replace(joint_clip.cut(1), notes=(*joint_clip.notes, "frame 1, an added T-pose, was left out"))
    return to_clip(joint_clip, CMU_MAP)


def _has_joints(names: tuple[str, ...], joint_map: JointMap) -> bool:
    return {joint for bone in joint_map.values() for joint in (bone.joint, bone.tip) if joint} <= set(names)


def _length_unit(path: Path, text: BvhText, names: tuple[str, ...]) -> tuple[float, str]:
    """Unit of length [m] and the evidence for it."""
    height = _rest_height(path, text)
    return _EXPORT_UNIT if _has_joints(names, EXPORT_MAP) else guess_unit(path, height)


def starts_in_t_pose(joint_clip: JointClip) -> bool:
    """Whether frame 1 is an added T-pose: its root is placed as in frame 2, but not rotated."""
    if len(joint_clip) < 2:
        return False
    still = np.array_equal(joint_clip.root_m[0], joint_clip.root_m[1])
    return still and bool(np.abs(joint_clip.parent_from_joint[0, 0, 1:]).max() < 1e-9)


def guess_unit(path: Path, height: float) -> tuple[float, str]:
    """The unit of length [m] in which a person of `height` is person-sized, and the evidence; BadFile if none is."""
    low, high = HEIGHT_M
    fits = [(name, unit) for name, unit in UNITS_M.items() if low <= height * unit <= high]
    if len(fits) != 1:
        found = f"a rest pose {height:.4g} tall, which fits none of {', '.join(UNITS_M)}"
        raise BadFile(path, found, f"a person of {low} to {high} m", "Give the unit's length in metres (--unit).")
    name, unit = fits[0]
    return unit, f"{name}, the one usual unit in which its rest pose ({height * unit:.2f} m) is a person's"


def _rest_height(path: Path, text: BvhText) -> float:
    """Height of the rest pose in the file's unit; BadFile unless y is up and x is left in it."""
    at = rest_positions([joint.parent for joint in text.joints], np.array([joint.offset for joint in text.joints]))
    size = np.ptp(at, axis=0)
    if size[1] <= 0.0 or size[1] < size[2]:
        found = "a rest pose that does not stand along y ({:.3g} x {:.3g} x {:.3g})".format(*size)
        raise BadFile(path, found, "x left, y up, z forward", "Export it with Y up.")
    left = [at[j, 0] for j, joint in enumerate(text.joints) if joint.name.startswith("Left")]
    if left and np.mean(left) < 0.0:
        raise BadFile(path, "left joints at negative x", "x left, y up, z forward", "Export it facing +z.")
    return float(size[1])


def _load_with_pymotion(text: BvhText) -> Any:
    """The file as a pymotion object; pymotion gets it in a simple form that it is known to read."""
    from pymotion.io.bvh import BVH

    bvh = BVH()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "motion.bvh"
        file.write_text(text.canonical(), encoding="ascii")
        bvh.load(str(file))
    return bvh


def _rate_hz(frame_time_s: float) -> float:
    """Frames per second, rounded to a whole number where the digits of the frame time allow it (.0083333: 120)."""
    rate_hz = 1.0 / frame_time_s
    return float(round(rate_hz)) if abs(round(rate_hz) - rate_hz) < 1e-4 * rate_hz else rate_hz


def _rotate_to_world(rotation: Floats) -> Floats:
    """Quaternions (w, x, y, z) from the file's axes to the world's, a cyclic permutation of x, y and z."""
    out: Floats = np.concatenate([rotation[..., :1], rotation[..., 1:] @ WORLD_FROM_ASF.T], axis=-1)
    return out
